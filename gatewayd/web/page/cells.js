// All cells at a glance: each with its mark and, where it is not well, why. The one that is shown is marked.

import { LEVELS, MARKS } from "./picture.js";
import { make, put, putName } from "./words.js";

const ORDER = ["idle", "good", "warn", "bad"];

export function worstOf(levels) {
  return levels.reduce((worst, level) => ORDER.indexOf(level) > ORDER.indexOf(worst) ? level : worst, "idle");
}

export class Cells {
  constructor(place) {
    this.place = place;
    this.list = make("ul", "plain");
    place.append(this.list);
    this.names = [];
    this.cells = [];
  }

  // The others than `current` that are not well, as parts of a picture are.
  others(current) {
    return this.cells.filter((cell) => cell.name !== current);
  }

  show(cells, current) {
    this.cells = cells;
    this.place.hidden = cells.length < 2;
    if (cells.map((cell) => cell.name).join("\n") !== this.names.join("\n")) this.build(cells);
    cells.forEach((cell, index) => {
      const { link, mark, level, words } = this.parts[index];
      link.dataset.level = cell.level;
      if (cell.name === current) link.setAttribute("aria-current", "page");
      else link.removeAttribute("aria-current");
      put(mark, MARKS[cell.level]);
      put(level, `: ${LEVELS[cell.level]}`);
      put(words, cell.level === "good" ? "" : cell.words);
    });
  }

  build(cells) {
    this.names = cells.map((cell) => cell.name);
    this.parts = cells.map((cell) => {
      const link = make("a"), mark = make("span", "mark"), level = make("span", "unseen"), words = make("span", "why");
      link.href = `#${encodeURIComponent(cell.name)}`;
      mark.setAttribute("aria-hidden", "true");
      const name = make("strong");
      putName(name, cell.name);
      link.append(mark, name, level, words);
      return { link, mark, level, words };
    });
    this.list.replaceChildren(...this.parts.map(({ link }) => {
      const item = make("li");
      item.append(link);
      return item;
    }));
  }
}
