// Who looks: the token, kept until the tab is closed, and what its role may do. It goes into one header and nowhere else.

import { byId, printable, put } from "./words.js";

const KEPT = "gatewayd-token";
const ROLES = { viewer: 1, operator: 2, engineer: 3 };
const PATIENCE = 5000;
const SOON = 24 * 3600;

// The gateway does not know who asks: the page has to sign in before it shows anything.
export class SignInNeeded extends Error {}

export class Session {
  constructor() {
    this.token = sessionStorage.getItem(KEPT) ?? "";
    this.tokens = false;              // whether the gateway takes tokens
    this.caller = null;
    this.needed = false;              // whether it shows nothing to whom it does not know
    byId("sign-in").addEventListener("click", () => this.open());
    byId("sign-out").addEventListener("click", () => this.forget());
    byId("token-cancel").addEventListener("click", () => byId("session").close());
    byId("token-go").addEventListener("click", () => this.enter());
    byId("token").addEventListener("keydown", (event) => { if (event.key === "Enter") this.enter(); });
  }

  // Whether there is no use in asking the gateway before somebody has signed in.
  get isAsking() {
    return this.needed && this.token === "";
  }

  get headers() {
    return this.token ? { Authorization: `Bearer ${this.token}` } : {};
  }

  // Why this role may not do it; empty: it may.
  lack(role) {
    if (!this.tokens) return "The gateway was started without tokens: this page only shows.";
    if (this.caller === null) return "Sign in to do this.";
    const lacks = ROLES[this.caller.role] < ROLES[role];
    return lacks ? `This needs the role ${role}; ${this.caller.name} is ${this.caller.role}.` : "";
  }

  async ask() {
    const response = await fetch("page/session", {
      headers: this.headers, signal: AbortSignal.timeout(PATIENCE), cache: "no-store",
    });
    if (response.status === 401) this.refused((await response.text()).trim());
    if (!response.ok) throw new Error(`${response.status} ${(await response.text()).trim().slice(0, 100)}`);
    const { tokens, caller } = await response.json();
    Object.assign(this, { tokens, caller });
    this.show();
  }

  // The gateway does not take the token any more, or wants one. Says why, and asks for another one.
  refused(words) {
    const had = this.token !== "";
    this.forget();
    this.tokens = this.needed = true;
    if (!byId("session").open) this.open(had ? `Signed out: ${words}.` : "");
    throw new SignInNeeded(words);
  }

  open(words = "") {
    byId("token").value = "";
    put(byId("token-error"), printable(words));
    if (!byId("session").open) byId("session").showModal();
  }

  async enter() {
    const given = byId("token").value.trim();
    if (!given) {
      put(byId("token-error"), "The token is missing: gatewayd token create has printed it.");
      return;
    }
    byId("token-go").disabled = true;
    try {
      const response = await fetch("page/session", {
        headers: { Authorization: `Bearer ${given}` }, signal: AbortSignal.timeout(4 * PATIENCE), cache: "no-store",
      });
      if (!response.ok) throw new Error((await response.text()).trim().slice(0, 200));
      const { tokens, caller } = await response.json();
      if (caller === null) throw new Error("the gateway takes no tokens");
      Object.assign(this, { tokens, caller, token: given, needed: false });
      sessionStorage.setItem(KEPT, given);
      byId("token").value = "";
      byId("session").close();
      this.show();
    } catch (error) {
      put(byId("token-error"), `Not signed in: ${printable(error.message)}.`);
    } finally {
      byId("token-go").disabled = false;
    }
  }

  forget() {
    this.token = "";
    this.caller = null;
    sessionStorage.removeItem(KEPT);
    this.show();
  }

  show() {
    const { caller } = this, who = byId("who");
    byId("sign-in").hidden = caller !== null || !this.tokens;
    byId("sign-out").hidden = who.hidden = caller === null;
    if (caller === null) return;
    const left = caller.expires - Date.now() / 1000, end = new Date(caller.expires * 1000);
    put(who, `${printable(caller.name)}, ${caller.role}` + (left < SOON ? `, until ${end.toLocaleTimeString()}` : ""));
    who.title = `This token ends ${end.toLocaleString()}`;
  }
}
