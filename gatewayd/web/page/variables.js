// The table of variables: filter, live values, a small plot for each, a large one with all facts for the open one.

import { areaOf, factsOf, placesOn } from "./facts.js";
import { Groups } from "./groups.js";
import { History } from "./history.js";
import { FORCED, OPERATOR, byId, make, meaning, number, ownerName, put, putName, quality, span } from "./words.js";

const KINDS = [
  ["all", "All", () => true],
  ["inputs", "Inputs", (row) => row.variable.direction === "input"],
  ["outputs", "Outputs", (row) => row.variable.direction === "output"],
  ["owned", "Owned", (row) => row.owner !== ""],
  ["odd", "Not good", (row) => row.code !== 0],
];

export class Variables {
  constructor(samplesPerSecond, operate) {
    this.operate = operate;
    this.samplesPerSecond = samplesPerSecond;
    this.rows = [];
    this.kind = "all";
    this.open = null;
    this.seen = new Set();
    this.watch = new IntersectionObserver((entries) => {
      for (const { target, isIntersecting } of entries) {
        if (isIntersecting) this.seen.add(target.row);
        else this.seen.delete(target.row);
      }
    }, { rootMargin: "100px" });
    this.buildKinds();
    byId("filter").addEventListener("input", () => this.filter());
    document.addEventListener("keydown", (event) => this.key(event));
  }

  buildKinds() {
    for (const [id, title] of KINDS) {
      const button = make("button", "kind", title);
      button.type = "button";
      button.setAttribute("aria-pressed", String(id === this.kind));
      if (id === "odd") this.odd = button;
      button.addEventListener("click", () => {
        this.kind = id;
        for (const one of byId("kinds").children) one.setAttribute("aria-pressed", String(one === button));
        this.filter();
      });
      byId("kinds").append(button);
    }
  }

  key(event) {
    const field = byId("filter");
    if (event.key === "/" && document.activeElement !== field) {
      event.preventDefault();
      field.focus();
    } else if (event.key === "Escape" && document.activeElement === field) {
      field.value = "";
      this.filter();
    }
  }

  // Another mapping: all rows anew.
  build(layout) {
    this.layout = layout;
    this.history = new History(layout.variables.length, this.samplesPerSecond);
    this.watch.disconnect();
    this.seen.clear();
    this.open = null;
    const table = byId("rows").parentElement;
    for (const link of ["modbus", "canopen"]) {
      table.classList.toggle(`no-${link}`, !layout.variables.some((variable) => placesOn(link, variable).length));
    }
    table.classList.toggle("units", layout.variables.some((one) => one.unit));
    this.rows = layout.variables.map((variable) => new Row(variable, (row) => this.toggle(row)));
    const columns = this.rows[0]?.element.children.length ?? 1;
    this.groups = new Groups(layout, this.rows, columns, () => this.filter());
    byId("rows").replaceChildren(...this.groups.elements);
    for (const row of this.rows) this.watch.observe(row.element);
    this.filter();
  }

  update(state, now) {
    const forces = new Map(state.forced.map(([index, ...force]) => [index, force]));
    const owners = new Map(state.owned.map(([lock, ...owned]) => [lock, owned]));
    this.history.add(now, state.values, state.quality);
    for (const [index, row] of this.rows.entries()) {
      const [owner, left, holders] = owners.get(row.variable.lock) ?? [null, null, ""];
      const name = owner === null ? "" : ownerName(owner, holders, this.layout.writers);
      row.keep(name, owner === OPERATOR, forces.has(index), state.values[index]);
      row.update(state.values[index], state.quality[index], state.ages[index], name, left, forces.get(index));
    }
    const odd = this.rows.reduce((sum, row) => sum + (row.code !== 0), 0);
    put(this.odd, odd ? `Not good ${odd}` : "Not good");
    this.odd.classList.toggle("some", odd > 0);
    if (this.kind === "owned" || this.kind === "odd" || byId("filter").value) this.filter();
    else this.groups.update((row) => row.wanted);
    this.draw(now);
  }

  draw(now) {
    for (const row of this.seen) {
      if (!row.element.hidden) this.history.draw(row.canvas, row.variable.number - 1, now, row.variable.kind);
    }
    if (this.open) {
      const { variable, detail } = this.open;
      const [low, high] = this.history.range(variable.number - 1, now);
      this.history.draw(detail.canvas, variable.number - 1, now, variable.kind);
      put(detail.range, `lowest ${number(low, variable.kind)}, highest ${number(high, variable.kind)} ${variable.unit}`.trim());
    }
  }

  filter() {
    const words = byId("filter").value.trim().toLowerCase().split(/\s+/);
    const fits = KINDS.find(([id]) => id === this.kind)[2];
    let shown = 0;
    for (const row of this.rows) {
      const text = `${row.text} ${row.owner}`;
      row.wanted = fits(row) && words.every((word) => text.includes(word));
      const visible = row.wanted && !this.groups.folds(row);
      if (row.element.hidden === visible) row.element.hidden = !visible;
      if (row.detail) row.detail.element.hidden = !visible;
      shown += row.wanted;
    }
    this.groups.update((row) => row.wanted);
    put(byId("shown"), shown === this.rows.length ? String(shown) : `${shown} of ${this.rows.length}`);
    byId("nothing").hidden = shown > 0 || this.rows.length === 0;
  }

  toggle(row) {
    if (this.open) this.open.close();
    this.open = this.open === row ? null : row;
    if (this.open) row.expand(this.layout, this.operate);
    this.draw(performance.now());
  }
}

class Row {
  constructor(variable, toggle) {
    this.variable = variable;
    this.owner = "";
    this.code = -1;
    this.wanted = true;
    this.state = { owner: "", operators: false, forced: false, value: 0 };
    this.detail = null;
    this.text = [variable.name, variable.robot, variable.comment,
      ...variable.places.flatMap((place) => [place.address, place.notation])].join(" ").toLowerCase();
    const row = this.element = make("tr", variable.direction);
    row.row = this;
    this.button = make("button", "name");
    putName(this.button, variable.name);
    this.button.type = "button";
    this.button.setAttribute("aria-expanded", "false");
    this.button.addEventListener("click", () => toggle(this));
    this.value = make("span", "value");
    this.canvas = make("canvas", "spark");
    const robot = make("span", "robot muted");
    putName(robot, `${variable.direction === "input" ? "→" : "←"}\u00a0${variable.robot}`);
    this.canvas.setAttribute("aria-hidden", "true");
    this.quality = make("span", "quality");
    this.meaning = make("span", "meaning");
    this.truth = make("span", "truth");
    this.holder = make("span", "owner");
    const modbus = placesOn("modbus", variable), objects = placesOn("canopen", variable);
    const cells = [
      ["name", this.button, robot],
      ["value right", this.value, make("span", "unit muted", variable.unit), this.meaning, this.truth],
      ["plot", this.canvas],
      ["quality", this.quality],
      ["owner", this.holder],
      ["address modbus", ...modbus.map((place) => make("span", "", areaOf(place) + place.address))],
      ["notation modbus", ...modbus.map((place) => make("span", "muted", place.notation))],
      ["object canopen", ...objects.map((place) => make("span", "", place.address))],
      ["cob-id canopen", ...objects.map((place) => make("span", "muted", place.notation.replace("COB-ID ", "")))],
    ];
    row.append(...cells.map(([className, ...content]) => {
      const cell = make("td", className);
      cell.append(...content);
      return cell;
    }));
  }

  update(value, code, age, owner, left, force) {
    const { kind, unit } = this.variable;
    put(this.value, number(value, kind));
    put(this.meaning, meaning(value, this.variable));
    const [rest, reported, its, by] = force ?? [null, null, null, ""];
    put(this.quality, !force ? quality(code, age)
      : code === FORCED ? `forced, ${span(rest)} left` : `${quality(code, age)}; forced, ${span(rest)} left`);
    // The truth beside the force: what the robot reports, or reads back of an input, and how good that is.
    const says = this.variable.direction === "input" ? "robot holds" : "reports";
    const truth = its === null ? "" : `${says} ${number(reported, kind)} ${meaning(reported, this.variable) || unit}`.trimEnd();
    this.truth.classList.toggle("muted", its === 0 && reported === value);
    put(this.truth, truth && its > 0 ? `${truth}, ${quality(its, null)}` : truth);
    const words = owner && left !== null ? `${owner}, ${span(left).replaceAll(" ", "\u00a0")}` : owner;
    const source = code === FORCED ? ownerName(OPERATOR, by, []) : "robot";
    put(this.holder, this.variable.direction === "input" ? words || "free" : source);
    if (code !== this.code) this.element.dataset.quality = code;
    this.holder.classList.toggle("muted", !owner);
    this.element.classList.toggle("on", value === true);
    this.code = code;
    this.owner = owner;
  }

  // What acts on it have to know of its present state.
  keep(owner, operators, forced, value) {
    Object.assign(this.state, { owner, operators, forced, value });
    if (this.detail) this.detail.operate.refresh(this.detail.acts, this.detail.subject);
  }

  expand(layout, operate) {
    const { variable } = this;
    const element = make("tr", "detail"), cell = make("td");
    cell.colSpan = this.element.children.length;
    const canvas = make("canvas", "plot"), range = make("span");
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", `${variable.name}, the last 60 seconds`);
    const axis = make("p", "axis muted");
    axis.append(make("span", "", "60 s ago"), range, make("span", "", "now"));
    const facts = make("dl");
    for (const [term, text] of factsOf(variable, layout)) {
      if (text) facts.append(make("dt", "muted", term), make("dd", "", text));
    }
    const lock = variable.lock === null ? null : layout.locks[variable.lock];
    const subject = { cell: layout.cell, variable, lock, state: this.state };
    const acts = operate.buttons(subject);
    operate.refresh(acts, subject);
    cell.append(canvas, axis, facts, acts);
    element.append(cell);
    this.element.after(element);
    this.detail = { element, canvas, range, operate, acts, subject };
    this.button.setAttribute("aria-expanded", "true");
  }

  close() {
    this.detail.element.remove();
    this.detail = null;
    this.button.setAttribute("aria-expanded", "false");
  }
}
