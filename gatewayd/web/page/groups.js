// Variables that belong together, under one label that folds them: a group that is owned as one, a vector, a range.

import { count, make, put, putName } from "./words.js";

// The groups by what names them, in the order of their first members; variables are indices.
function groupsOf({ variables, locks }) {
  const found = new Map();
  variables.forEach(({ name, lock }, index) => {
    const together = lock !== null && locks[lock].variables.length > 1;
    const family = name.match(/^(.+)\[\d+\]$/)?.[1];
    const title = together ? locks[lock].name : family;
    if (title === undefined) return;
    const key = `${together} ${title}`;
    if (!found.has(key)) found.set(key, { title, together, members: [] });
    found.get(key).members.push(index);
  });
  return [...found.values()].filter((group) => group.members.length > 1);
}

export class Groups {
  // `rows` are in the order of the mapping; `changed` is called when a label was folded or unfolded.
  constructor(layout, rows, columns, changed) {
    this.labels = groupsOf(layout).map((group) => new Label(group, rows, columns, changed));
    this.of = new Map(this.labels.flatMap((label) => label.rows.map((row) => [row, label])));
    const placed = new Set();
    this.elements = rows.flatMap((row) => {
      const label = this.of.get(row);
      if (label === undefined) return [row.element];
      if (placed.has(label)) return [];
      placed.add(label);
      return [label.element, ...label.rows.map((member) => member.element)];
    });
  }

  folds(row) {
    return this.of.get(row)?.folded ?? false;
  }

  // After the filter has decided for each row whether it is `wanted`.
  update(wanted) {
    for (const label of this.labels) label.update(label.rows.filter(wanted));
  }
}

class Label {
  constructor({ title, together, members }, rows, columns, changed) {
    this.rows = members.map((index) => rows[index]);
    this.folded = false;
    for (const row of this.rows) row.element.classList.add("member");
    this.element = make("tr", "group");
    const cell = make("td"), button = make("button", "fold");
    putName(button, title);
    this.words = make("span", "muted");
    this.odd = make("span", "odd");
    cell.colSpan = columns;
    button.type = "button";
    button.setAttribute("aria-expanded", "true");
    button.addEventListener("click", () => {
      this.folded = !this.folded;
      button.setAttribute("aria-expanded", String(!this.folded));
      changed();
    });
    this.together = together ? ", owned together" : "";
    cell.append(button, this.words, this.odd);
    this.element.append(cell);
  }

  update(wanted) {
    this.element.hidden = wanted.length === 0;
    const odd = wanted.filter((row) => row.code !== 0).length;
    put(this.words, `${count(wanted.length, "variable")}${this.together}`);
    put(this.odd, odd ? `▲ ${odd} not good` : "");
  }
}
