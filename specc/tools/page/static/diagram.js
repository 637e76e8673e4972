/** A picture of `specc graph` in a card: as large as fits, else scrolled to what matters. */

import { html, parseSvg } from "./dom.js";

const LEAST = 0.8;
/** Pixels for a unit of a picture, whose text is 10 units high; smaller is not legible. */
const NATURAL = 4 / 3;
const MOST = 1.5;
const MOST_ALONE = 2.5;
/** In a card that fills the place of all. */
const MARGIN = 4;
const NARROW = matchMedia("(max-width: 699px)");
const CALM = matchMedia("(prefers-reduced-motion: reduce)");

export class Diagram {
  /** @param {HTMLElement} container */
  constructor(container) {
    this.container = container;
    this.svg = null;
    this.url = null;
    this.centred = null;
    new ResizeObserver(() => this.fit()).observe(container);
  }

  /**
   * Show the picture at an address; false if another one was asked for meanwhile.
   * @param {string|null} url
   * @returns {Promise<boolean>}
   */
  async show(url) {
    this.url = url;
    this.centred = null;
    const { svg, words } = await this.load(url);
    if (this.url !== url) {
      return false;
    }
    this.svg = svg;
    if (svg) {
      this.container.replaceChildren(svg);
      this.crop();
      this.fit();
    } else {
      this.container.replaceChildren(html("p", { class: "empty" }, words));
    }
    return true;
  }

  /** The picture at an address, or why there is none. */
  async load(url) {
    if (!url) {
      return { svg: null, words: "There is no picture of this." };
    }
    const none = { svg: null, words: "The picture could not be drawn." };
    try {
      const answer = await fetch(url);
      const text = await answer.text();
      if (answer.ok && answer.headers.get("content-type").startsWith("text/plain")) {
        return { svg: null, words: `There is no picture: ${text}.` };
      }
      return answer.ok ? { svg: parseSvg(text), words: none.words } : none;
    } catch {
      return none;
    }
  }

  /** Leave no empty space around what is drawn. */
  crop() {
    const { x, y, width, height } = this.svg.getBBox();
    this.width = width + 2 * MARGIN;
    this.height = height + 2 * MARGIN;
    this.svg.setAttribute("viewBox", `${x - MARGIN} ${y - MARGIN} ${this.width} ${this.height}`);
  }

  fit() {
    if (!this.svg || !this.container.clientWidth) {
      return;
    }
    const { clientWidth: width, clientHeight: height } = this.container;
    const fitting = Math.min(width / this.width, height / this.height);
    const most = this.container.closest(".large") ? MOST_ALONE : MOST;
    const scale = NARROW.matches ? NATURAL : Math.max(LEAST, Math.min(most, fitting));
    this.svg.setAttribute("width", Math.floor(this.width * scale));
    this.svg.setAttribute("height", Math.floor(this.height * scale));
    const element = this.centred;
    this.centred = null;
    this.centre(element, false);
  }

  /** The element with an id, and those that belong to it: they have the id as a class. */
  find(id) {
    const name = CSS.escape(id);
    const others = this.svg?.querySelectorAll(`.${name}:not(#${name})`) ?? [];
    return [this.svg?.querySelector(`#${name}`), ...others].filter(Boolean);
  }

  /** Scroll to an element, if it is another than the last one. */
  centre(element, is_smooth = !CALM.matches) {
    // Nothing moves away from under a pointer that is about to click.
    const is_pointed_at = this.centred && this.container.matches(":hover");
    if (!element || element === this.centred || is_pointed_at) {
      return;
    }
    this.centred = element;
    const { container } = this;
    const inside = element.getBoundingClientRect();
    const around = container.getBoundingClientRect();
    const left = inside.left + inside.width / 2 - around.left - container.clientWidth / 2;
    const top = inside.top + inside.height / 2 - around.top - container.clientHeight / 2;
    container.scrollBy({ left, top, behavior: is_smooth ? "smooth" : "instant" });
  }
}
