// Asks the gateway four times a second and shows what it says. What is not answered in time is shown as old, at once.

import { Cells, worstOf } from "./cells.js";
import { Operate } from "./operate.js";
import { LEVELS, MARKS, Picture } from "./picture.js";
import { Session, SignInNeeded } from "./session.js";
import { Variables } from "./variables.js";
import { byId, clock, count, make, ownerName, printable, put, putName, span } from "./words.js";

const PERIOD = 250;
const PATIENCE = 1500;                // without an answer for so long, nothing on the page is believed
const GLANCE = 4;                     // looks at this cell for each look at all of them
const SESSION = 40;                   // looks at this cell for each question whether the role is still the same
const EVENTS = 200;

const picture = new Picture(byId("picture"));
const cells = new Cells(byId("cells"));
const session = new Session();
const operate = new Operate(session);
const variables = new Variables(1000 / PERIOD, operate);
let layout = null, cell = null, events = 0, looks = 0, missed = true;
let answered = -Infinity, answeredAt = null, trouble = "";

async function ask(path) {
  const response = await fetch(path, {
    headers: session.headers, signal: AbortSignal.timeout(PATIENCE), cache: "no-store",
  });
  if (response.status === 401) session.refused((await response.text()).trim());
  if (!response.ok) throw new Error(`${response.status} ${(await response.text()).trim().slice(0, 100)}`);
  return response.json();
}

async function choose() {
  await session.ask();
  const { cells: found, gatewayd } = await ask("page/cells");
  const names = found.map((one) => one.name);
  const wanted = decodeURIComponent(location.hash.slice(1));
  cell = names.includes(wanted) ? wanted : names[0];
  if (cell === undefined) throw new Error("the gateway serves no cell");
  operate.close();
  cells.show(found, cell);
  putName(byId("cell"), cell);
  byId("cell").title = `gatewayd ${gatewayd}`;
  looks = 0;
  layout = await ask(`page/cells/${encodeURIComponent(cell)}`);
  missed = true;
  events = 0;
  byId("happened").replaceChildren();
  variables.build(layout);
}

async function look() {
  if (layout === null) await choose();
  const asked = layout;
  if (missed) {
    const history = await ask(`page/cells/${encodeURIComponent(cell)}/history`);
    if (asked !== layout) return;
    variables.history.refill(history, performance.now());
    missed = false;
  }
  looks += 1;
  if (looks % SESSION === 0) await session.ask();
  if (looks % GLANCE === 0) cells.show((await ask("page/cells")).cells, cell);
  if (asked !== layout) return;
  const state = await ask(`page/cells/${encodeURIComponent(cell)}/state?since=${events}`);
  if (asked !== layout) return;
  if (state.fingerprint !== layout.fingerprint) {
    layout = null;
    return look();
  }
  const now = performance.now();
  picture.show(state.picture);
  showWorst(state.picture);
  variables.update(state, now);
  showLocks(state);
  showEvents(state.events);
  const level = worstOf([state.picture.level, ...cells.others(cell).map((other) => other.level)]);
  document.title = `${MARKS[level]} ${cell} - gatewayd`;
  answered = now;
  answeredAt = new Date();
  trouble = "";
  judge();
}

// In the header, so that trouble stays in sight below the picture and on the other tabs of a phone.
function showWorst({ robot, gateway, buses, writers }) {
  const nodes = [robot, gateway, ...buses, ...writers, ...cells.others(cell)];
  const level = ["bad", "warn"].find((one) => nodes.some((node) => node.level === one));
  const worst = byId("worst");
  worst.hidden = level === undefined;
  if (level === undefined) return;
  const names = nodes.filter((node) => node.level === level).map((node) => node.name);
  worst.dataset.level = level;
  const shown = names.length > 1 ? `${names.length} ${level === "bad" ? "in trouble" : "need attention"}` : names[0];
  worst.setAttribute("aria-label", `${MARKS[level]} ${shown}, ${LEVELS[level]}: ${names.join(", ")}`);
  put(worst, `${MARKS[level]} ${shown}`);
}

function showLocks(state) {
  const owned = byId("owned"), total = layout.locks.length;
  put(byId("locks-count"), state.owned.length ? String(state.owned.length) : "");
  put(byId("locks-summary"), `${state.owned.length} of ${total} owned`);
  while (owned.children.length > state.owned.length) owned.lastChild.remove();
  while (owned.children.length < state.owned.length) {
    const item = make("li");
    item.append(make("strong"), make("span", "by"), make("span", "left muted"));
    owned.append(item);
  }
  state.owned.forEach(([lock, owner, left, holders], index) => {
    const [name, by, rest] = owned.children[index].children;
    const { name: title, variables: members } = layout.locks[lock];
    putName(name, members.length > 1 ? `${title} (${count(members.length, "variable")})` : title);
    put(by, ownerName(owner, holders, layout.writers));
    put(rest, left === null ? "until released" : `${span(left)} left`);
  });
}

function showEvents({ count: told, latest }) {
  const list = byId("happened");
  if (told < events) list.replaceChildren();
  events = told;
  for (const event of latest) {
    const item = make("li", event.bad ? "bad" : "");
    const at = make("time", "muted", clock(new Date(event.time * 1000)));
    at.dateTime = new Date(event.time * 1000).toISOString();
    item.append(at, make("span", "", event.text));
    list.prepend(item);
  }
  while (list.children.length > EVENTS) list.lastChild.remove();
}

// Whether what is shown may be believed, said where nobody can overlook it.
function judge() {
  const age = performance.now() - answered, out = session.isAsking;
  const contact = age <= PATIENCE ? "live" : answeredAt ? "lost" : trouble && !out ? "lost" : "waiting";
  const alarm = byId("alarm");
  document.body.dataset.contact = contact;
  put(byId("contact-words"), out ? "not signed in" : { live: "live", lost: "no answer", waiting: "connecting" }[contact]);
  alarm.hidden = contact !== "lost";
  if (contact !== "lost") return;
  byId("worst").hidden = true;
  const since = answeredAt ? `since ${clock(answeredAt)} (${span(age)})` : "so far";
  document.title = `? ${cell ?? ""} - ${out ? "not signed in" : "no answer"}`;
  const words = out ? `Not signed in ${since}.` : `No answer from the gateway ${since}.`;
  put(alarm, `${words} ${answeredAt ? "Everything below is old." : ""}`);
  alarm.title = printable(trouble);
}

async function run() {
  for (;;) {
    const begun = performance.now();
    if (!document.hidden && !session.isAsking) {
      try {
        await look();
      } catch (error) {
        trouble = String(error.message ?? error);
        if (error instanceof SignInNeeded) answered = -Infinity;
        if (trouble.startsWith("404") || error instanceof SignInNeeded) layout = null;
        judge();
      }
    }
    await new Promise((done) => setTimeout(done, Math.max(20, PERIOD - (performance.now() - begun))));
  }
}

function start() {
  byId("worst").addEventListener("click", () => scrollTo({ top: 0 }));
  addEventListener("hashchange", () => { layout = null; });
  for (const button of document.querySelectorAll(".tabs button")) {
    button.addEventListener("click", () => {
      document.body.dataset.tab = button.dataset.tab;
      for (const one of document.querySelectorAll(".tabs button")) one.setAttribute("aria-pressed", String(one === button));
    });
  }
  document.addEventListener("visibilitychange", () => {
    missed = true;
    judge();
  });
  setInterval(judge, PERIOD);
  run();
}

start();
