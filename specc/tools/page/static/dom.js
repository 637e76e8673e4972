/** Elements, texts and numbers of the page. Texts of a run get into it as text only. */

const SVG = "http://www.w3.org/2000/svg";

/**
 * Give an element its properties and content.
 * @template {Element} T
 * @param {T} element
 * @param {Object<string, any>} properties attributes, and handlers by `on…`; false leaves one out
 * @param {Array<Node|string|null|undefined>} content
 * @returns {T}
 */
function fill(element, properties, content) {
  for (const [name, value] of Object.entries(properties)) {
    if (value === false || value === null || value === undefined) {
      continue;
    }
    if (name.startsWith("on")) {
      element.addEventListener(name.slice(2), value);
    } else {
      element.setAttribute(name, value === true ? "" : String(value));
    }
  }
  element.append(...content.filter((item) => item !== null && item !== undefined));
  return element;
}

/** An element of HTML. */
export function html(tag, properties = {}, ...content) {
  return fill(document.createElement(tag), properties, content);
}

/** An element of SVG. */
export function svg(tag, properties = {}, ...content) {
  return fill(document.createElementNS(SVG, tag), properties, content);
}

/** A button; `title` says what it does, with its key. */
export function button(text, title, onclick, properties = {}) {
  return html("button", { type: "button", title, onclick, ...properties }, text);
}

/** A picture for a button, of strokes in a square of 16 units. */
export function icon(d) {
  const path = svg("path", { d });
  return svg("svg", { class: "icon", viewBox: "0 0 16 16", "aria-hidden": "true" }, path);
}

/** The element of the page with that id. */
export function byId(id) {
  return document.getElementById(id);
}

/** Set a text where it differs, so that nothing is laid out anew without need. */
export function setText(element, text) {
  if (element.textContent !== text) {
    element.textContent = text;
  }
}

/** A time for readers: `12.34 s`. */
export function seconds(time_s, digits = 2) {
  return `${time_s.toFixed(digits)} s`;
}

/** Digits behind the point that tell the stamps of a period apart. */
export function digitsOf(period_s) {
  return Math.max(1, Math.min(4, Math.ceil(-Math.log10(period_s) - 1e-9)));
}

/** A number for readers, with few digits and a true minus sign. */
export function number(value, digits = 4) {
  if (value === null || value === undefined) {
    return "–";
  }
  const size = Math.abs(value);
  const is_plain = size === 0 || (size >= 1e-3 && size < 1e5);
  const text = is_plain ? String(Number(value.toPrecision(digits))) : value.toExponential(2);
  return text.replace("-", "−");
}

/** A name with its last part told apart: `rover.c.x.eyes.` and `ahead`. */
export function dotted(name) {
  const at = name.lastIndexOf(".") + 1;
  return [html("span", { class: "owner" }, name.slice(0, at)), html("b", {}, name.slice(at))];
}

/** The line of a file, short, with the whole path on hover. */
export function placeOf(place) {
  const short = place.slice(place.lastIndexOf("/") + 1);
  return html("span", { class: "place", title: place }, short);
}

/** Call `action` once after `delay_ms` in which it was not asked for again. */
export function debounce(action, delay_ms) {
  let timer = 0;
  return (...values) => {
    clearTimeout(timer);
    timer = setTimeout(() => action(...values), delay_ms);
  };
}

const DRAWN = new Set([
  "svg", "g", "path", "polygon", "polyline", "ellipse", "circle", "rect", "line", "text", "tspan",
  "defs", "clipPath",
]);
const ATTRIBUTE = /^(id|class|d|points|c?x|c?y|r[xy]?|[xy][12]|width|height|viewBox|transform)$/;
const LOOK = /^(fill|stroke|font|text-anchor|opacity|clip-path|xml:space|d[xy]$|baseline-shift$)/;

/**
 * The root of a picture, with nothing in it but shapes and texts.
 * @param {string} text
 * @returns {SVGSVGElement|null}
 */
export function parseSvg(text) {
  const parsed = new DOMParser().parseFromString(text, "image/svg+xml").documentElement;
  if (parsed.namespaceURI !== SVG || parsed.localName !== "svg") {
    return null;
  }
  for (const element of [...parsed.querySelectorAll("*")]) {
    if (element.localName === "a") {
      element.replaceWith(...element.childNodes);
    } else if (!DRAWN.has(element.localName)) {
      element.remove(); // also titles: identifiers of Graphviz are nothing to be shown on hover
    }
  }
  for (const element of [parsed, ...parsed.querySelectorAll("*")]) {
    for (const { name } of [...element.attributes]) {
      if (!ATTRIBUTE.test(name) && !LOOK.test(name)) {
        element.removeAttribute(name);
      }
    }
  }
  return document.importNode(parsed, true);
}

/** Show a text beside the pointer, or nothing. */
export function hover(event, text) {
  const box = byId("hover");
  box.hidden = !text;
  if (!text) {
    return;
  }
  setText(box, text);
  const { offsetWidth: width, offsetHeight: height } = box;
  box.style.left = `${Math.max(4, Math.min(event.clientX + 12, innerWidth - width - 4))}px`;
  box.style.top = `${Math.max(4, event.clientY - height - 10)}px`;
}

/** Remember a choice of this browser for a system; nothing where it keeps nothing. */
export function remember(key, value) {
  try {
    localStorage.setItem(`specc ${key}`, JSON.stringify(value));
  } catch {
    // a browser that keeps nothing
  }
}

/** What was chosen before. */
export function recall(key, otherwise) {
  try {
    return JSON.parse(localStorage.getItem(`specc ${key}`)) ?? otherwise;
  } catch {
    return otherwise;
  }
}
