"""What can be measured of how a page looks: texts that leave their boxes, and their contrast."""

from __future__ import annotations

OUTSIDE = """(() => {
    const found = [];
    let count = 0;
    for (const text of document.querySelectorAll(".node > text, .cluster > text")) {
        const shape = text.parentNode.querySelector("path, polygon, ellipse");
        if (!shape)
            continue;
        const inner = text.getBBox(), outer = shape.getBBox();
        const over = Math.max(
            outer.x - inner.x, inner.x + inner.width - outer.x - outer.width,
            outer.y - inner.y, inner.y + inner.height - outer.y - outer.height);
        if (over > 0)
            found.push(`${text.textContent}: ${over}`);
        count += 1;
    }
    return [count, found];
})()"""
"""How many texts there are in boxes of pictures, and those that are not all inside."""

SIDEWAYS = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
"""How far a page scrolls to the side."""

FAINT = """(() => {
    const context = new OffscreenCanvas(1, 1).getContext("2d", {willReadFrequently: true});
    const known = new Map();

    /** Red, green, blue and alpha of a color, whatever its syntax. */
    function read(color) {
        if (!known.has(color)) {
            context.clearRect(0, 0, 1, 1);
            context.fillStyle = color;
            context.fillRect(0, 0, 1, 1);
            const [r, g, b, a] = context.getImageData(0, 0, 1, 1).data;
            known.set(color, [r, g, b, a / 255]);
        }
        return known.get(color);
    }

    const over = (top, ground, alpha = top[3]) =>
        [0, 1, 2].map((n) => top[n] * alpha + ground[n] * (1 - alpha)).concat(1);

    function luminance(color) {
        const parts = color.slice(0, 3).map((c) => c / 255);
        const linear = parts.map((c) => c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
    }

    function contrast(one, other) {
        const [low, high] = [luminance(one), luminance(other)].sort((a, b) => a - b);
        return (high + 0.05) / (low + 0.05);
    }

    /** What is behind a point in a picture: shapes that are drawn before a text. */
    function shapesBehind(text, x, y) {
        const shapes = [...text.closest("svg").querySelectorAll("path, polygon, ellipse, rect")];
        return shapes.filter((shape) => {
            const box = shape.getBoundingClientRect();
            const inside = box.left <= x && x <= box.right && box.top <= y && y <= box.bottom;
            const order = shape.compareDocumentPosition(text);
            const is_before = order & Node.DOCUMENT_POSITION_FOLLOWING;
            return inside && is_before && getComputedStyle(shape).fill !== "none";
        });
    }

    function ground(element, x, y) {
        const around = [];
        for (let one = element; one; one = one.parentElement)
            around.unshift(one);
        let color = read(getComputedStyle(document.documentElement).colorScheme.startsWith("dark")
            ? "black" : "white");
        for (const one of around)
            color = over(read(getComputedStyle(one).backgroundColor), color);
        if (element.closest("svg")) {
            for (const shape of shapesBehind(element, x, y)) {
                const style = getComputedStyle(shape);
                const fill = read(style.fill);
                color = over(fill, color, fill[3] * style.fillOpacity * style.opacity);
            }
        }
        return color;
    }

    const found = [];
    let count = 0;
    const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    for (let node = texts.nextNode(); node; node = texts.nextNode()) {
        const element = node.parentElement;
        const box = element.getBoundingClientRect();
        const is_seen = node.data.trim() && box.width && box.height
            && element.checkVisibility({opacityProperty: true, visibilityProperty: true})
            && !element.closest("[aria-disabled=true], :disabled, option, script, style");
        if (!is_seen)
            continue;
        const style = getComputedStyle(element);
        const behind = ground(element, box.x + box.width / 2, box.y + box.height / 2);
        const color = read(element.closest("svg") ? style.fill : style.color);
        let alpha = color[3];
        for (let one = element; one; one = one.parentElement)
            alpha *= getComputedStyle(one).opacity;
        const ratio = contrast(over(color, behind, alpha), behind);
        const is_large = parseFloat(style.fontSize) >= 24;
        if (ratio < (is_large ? 3 : 4.5))
            found.push(`${node.data.trim().slice(0, 40)} (${element.localName}.`
                + `${element.getAttribute("class")}): ${ratio.toFixed(2)}`);
        count += 1;
    }
    return [count, found];
})()"""
"""How many texts are seen, and those with less contrast than WCAG 2 asks for (AA)."""
