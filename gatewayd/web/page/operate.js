// Force, take and release from the page, as the role permits. Nothing is sent before it was said in full and confirmed.

import { byId, make, number, printable, put } from "./words.js";

const PATIENCE = 5000;
const NUMBER = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i;

// Each act: its button, whether it applies, what it asks for, where it goes, and what it does, in words.
const ACTS = {
  force: {
    title: "Force", role: "engineer", asks: ["value", "seconds"], seconds: 60, fits: () => true,
    path: ({ variable }) => `variables/${encodeURIComponent(variable.name)}/force`,
    says: ({ variable, state }, { value, for: seconds }) =>
      `Force ${variable.name} from ${number(state.value, variable.kind)} to ${value} ${variable.unit}`.trimEnd() + ` for ${seconds} s. ` +
      (variable.direction === "input"
        ? `The robot gets it at once. Writes to it are refused meanwhile; afterwards it takes its fallback: ${variable.fallback}.`
        : "The fieldbus sees it instead of what the robot reports."),
  },
  unforce: {
    title: "End force", role: "engineer", asks: [], fits: ({ state }) => state.forced,
    path: ({ variable }) => `variables/${encodeURIComponent(variable.name)}/unforce`,
    says: ({ variable }) => `End the force on ${variable.name}. ` + (variable.direction === "input"
      ? `It takes its fallback at once: ${variable.fallback}.` : "The fieldbus sees what the robot reports again."),
  },
  take: {
    title: "Take lock", role: "operator", asks: ["seconds"], seconds: 600, endless: true, of: "lock", fits: ({ lock }) => lock !== null,
    path: ({ lock }) => `locks/${encodeURIComponent(lock.name)}/take`,
    says: ({ lock, state }, { for: seconds }) =>
      (state.operators ? `Keep the lock ${lock.name}`
        : `Take the lock ${lock.name}${state.owner ? ` from ${state.owner}` : ", which nobody owns,"}`) +
      (seconds === undefined ? " until it is released. " : ` for ${seconds} s. `) +
      `Whoever else writes what it guards is refused meanwhile: ${lock.variables.join(", ")}. ` +
      (state.operators ? "No value changes."
        : state.owner ? "All of that takes its fallback at once." : "What was only adopted of that takes its fallback at once."),
  },
  release: {
    title: "Release lock", role: "operator", asks: [], of: "lock", fits: ({ state, lock }) => lock !== null && state.owner !== "",
    path: ({ lock }) => `locks/${encodeURIComponent(lock.name)}/release`,
    says: ({ lock, state }) => `Release the lock ${lock.name}, which ${state.operators ? "the " : ""}${state.owner} owns. ` +
      `What it guards takes its fallback at once: ${lock.variables.join(", ")}.`,
  },
};

export class Operate {
  constructor(session) {
    this.dialog = byId("act");
    this.session = session;
    byId("act-go").addEventListener("click", () => this.go());
    byId("act-cancel").addEventListener("click", () => this.dialog.close());
    for (const field of ["act-value", "act-seconds"]) {
      byId(field).addEventListener("input", () => this.ask());
      byId(field).addEventListener("keydown", (event) => { if (event.key === "Enter") this.go(); });
    }
  }

  // Buttons for a variable; `subject` has the cell, the variable, its lock or null, and its state, kept up to date.
  buttons(subject) {
    const place = make("p", "acts");
    for (const [name, act] of Object.entries(ACTS)) {
      const button = make("button", "kind", `${act.title} …`);
      button.type = "button";
      button.addEventListener("click", () => this.open(name, subject));
      place.append(button);
    }
    place.append(make("span", "lack muted"));
    return place;
  }

  // What does not apply is not there; what the role may not do is disabled, with the reason beside it.
  refresh(place, subject) {
    place.hidden = !this.session.tokens;
    const lacks = new Set();
    Object.values(ACTS).forEach((act, index) => {
      const button = place.children[index], lack = this.session.lack(act.role);
      button.hidden = !act.fits(subject);
      button.disabled = lack !== "";
      if (lack && !button.hidden) lacks.add(lack);
    });
    put(place.lastChild, [...lacks].join(" "));
  }

  open(name, subject) {
    Object.assign(this, { act: ACTS[name], subject });
    const { variable, cell } = subject;
    put(byId("act-title"), `${this.act.title}: ${this.act.of === "lock" ? subject.lock.name : variable.name} of ${cell}`);
    for (const field of ["value", "seconds"]) byId(`act-${field}`).parentElement.hidden = !this.act.asks.includes(field);
    byId("act-value").value = "";
    byId("act-seconds").value = String(this.act.seconds ?? "");
    put(byId("act-until"), this.act.endless ? "Seconds (empty: until it is released)" : "Seconds");
    this.ask();
    this.dialog.showModal();
  }

  close() {
    if (this.dialog.open) this.dialog.close();
  }

  // Back to what is asked for; what was confirmed before is no longer.
  ask() {
    this.sure = null;
    put(byId("act-says"), "");
    put(byId("act-error"), "");
    put(byId("act-go"), "Next");
  }

  body() {
    const body = { cell: this.subject.cell };
    if (this.act.asks.includes("value")) body.value = this.value();
    if (this.act.asks.includes("seconds")) {
      const seconds = byId("act-seconds").value.trim();
      if (this.act.endless && !seconds) return body;
      if (!NUMBER.test(seconds) || !(Number(seconds) > 0)) throw new Error("The time has to be a number of seconds.");
      body.for = Number(seconds);
    }
    return body;
  }

  value() {
    const { kind } = this.subject.variable;
    const value = byId("act-value").value.trim();
    if (!NUMBER.test(value)) throw new Error(`The value has to be a number${value.includes(",") ? ", with a point: 1.5" : ""}.`);
    if (kind === "bool" && !["0", "1"].includes(value)) throw new Error("A bit is 0 or 1.");
    return Number(value);
  }

  // The first time says what will happen; the second time, unless something was changed, does it.
  async go() {
    try {
      const body = this.body();
      const lack = this.session.lack(this.act.role);
      if (lack) throw new Error(lack);
      if (this.sure === null) {
        this.sure = JSON.stringify(body);
        this.owner = this.subject.state.owner;
        put(byId("act-says"), this.act.says(this.subject, body));
        put(byId("act-go"), `Yes, ${this.act.title.toLowerCase()}`);
        return;
      }
      const sent = this.sure;
      this.ask();
      if (this.owner !== this.subject.state.owner) throw new Error("The owner has changed meanwhile: look again.");
      await this.send(sent);
      this.dialog.close();
    } catch (error) {
      this.ask();
      put(byId("act-error"), printable(error.message));
    }
  }

  async send(body) {
    if (document.body.dataset.contact !== "live") throw new Error("The gateway does not answer: nothing was sent.");
    byId("act-go").disabled = true;
    let response;
    try {
      response = await fetch(`api/v1/${this.act.path(this.subject)}`, {
        method: "POST", body, headers: this.session.headers, signal: AbortSignal.timeout(PATIENCE),
      });
    } catch {
      throw new Error("No answer. Whether it was done is not known: look at the value.");
    } finally {
      byId("act-go").disabled = false;
    }
    if (response.ok) return;
    const text = await response.text();
    if (response.status === 401) {
      this.close();
      this.session.refused(text.trim());
    }
    let words = text.trim();
    try {
      words = JSON.parse(text).error.message;
    } catch { /* a plain line, as the listener itself answers */ }
    throw new Error(`Refused: ${words}.`);
  }
}
