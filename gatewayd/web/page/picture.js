// The cell as a picture: robot - gateway - buses - writers, each with its state in words.

import { make, put, putName } from "./words.js";

export const MARKS = { good: "●", warn: "▲", bad: "■", idle: "○" };
export const LEVELS = { good: "in order", warn: "attention", bad: "trouble", idle: "not there" };

export class Picture {
  constructor(place) {
    this.place = place;
    this.shape = "";
    this.parts = [];
  }

  show(picture) {
    const shape = [...picture.buses, ...picture.writers].map((one) => one.name).join(" ");
    if (shape !== this.shape) this.build(picture, shape);
    const told = [picture.robot, picture.gateway, ...picture.buses, ...picture.writers];
    told.forEach((one, index) => this.fill(this.parts[index], one));
    this.mark(this.robotLink, picture.robot.level);
    picture.buses.forEach((bus, index) => this.mark(this.busLinks[index], bus.level));
  }

  build(picture, shape) {
    this.shape = shape;
    this.parts = [];
    const robot = this.node("robot"), gateway = this.node("gateway");
    this.robotLink = this.link("RTDE");
    const buses = make("div", "buses");
    this.busLinks = picture.buses.map((bus) => {
      const link = this.link(bus.name.split(" ")[0]);
      buses.append(link, this.node("bus"));
      return link;
    });
    const writers = make("ul", "writers plain");
    writers.setAttribute("aria-label", "Writers");
    picture.writers.forEach(() => {
      const item = make("li");
      item.append(this.node("writer"));
      writers.append(item);
    });
    this.place.replaceChildren(robot, this.robotLink, gateway, buses, writers);
  }

  node(icon) {
    const node = make("div", `node ${icon}`);
    const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    const use = document.createElementNS("http://www.w3.org/2000/svg", "use");
    svg.setAttribute("aria-hidden", "true");
    use.setAttribute("href", `#${icon}`);
    svg.append(use);
    const text = make("div", "about");
    const name = make("strong"), state = make("p", "state"), facts = make("p", "facts muted");
    const mark = make("span", "mark"), level = make("span", "unseen"), words = make("span");
    mark.setAttribute("aria-hidden", "true");
    state.append(mark, level, words);
    text.append(name, state, facts);
    node.append(svg, text);
    this.parts.push({ node, name, mark, level, words, facts });
    return node;
  }

  link(label) {
    const link = make("div", "link");
    const words = make("span", "label"), mark = make("span", "mark");
    words.append(mark, label);
    link.append(make("span", "wire"), words);
    link.setAttribute("aria-hidden", "true");
    return link;
  }

  mark(link, level) {
    link.dataset.level = level;
    put(link.querySelector(".mark"), MARKS[level]);
  }

  fill(part, told) {
    part.node.dataset.level = told.level;
    putName(part.name, told.name);
    put(part.mark, MARKS[told.level]);
    put(part.level, `${LEVELS[told.level]}: `);
    put(part.words, told.words);
    put(part.facts, told.facts);
  }
}
