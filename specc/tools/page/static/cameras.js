/** Shows the picture of a chosen camera. */

const LARGEST_HEAD = 65_536;

/**
 * The parts of a binary message: four bytes (big-endian) with the length of a JSON text, the text,
 * the bytes of an image. Null for anything else.
 * @param {ArrayBuffer} data @returns {{camera: string, time_s: number, blob: Blob}|null}
 */
export function parsePicture(data) {
  if (!(data instanceof ArrayBuffer) || data.byteLength < 4) return null;
  const length = new DataView(data).getUint32(0);
  if (length > LARGEST_HEAD || 4 + length > data.byteLength) return null;
  try {
    const about = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
    const { camera, time_s } = about;
    if (typeof camera !== "string" || typeof time_s !== "number") return null;
    return { camera, time_s, blob: new Blob([new Uint8Array(data, 4 + length)]) };
  } catch {
    return null;
  }
}

/** A list of cameras, and the picture of the chosen one. */
export class CameraView {
  /**
   * @param {HTMLElement} parent what it is put into
   * @param {{cameras: string[], chosen?: string|null, onChoose: (camera: string|null) => void}} settings
   *   `onChoose` asks the server for pictures of this camera, or for none
   */
  constructor(parent, { cameras, chosen = null, onChoose }) {
    this.onChoose = onChoose;
    this.url = "";
    this.camera = null;
    this.select = document.createElement("select");
    this.select.setAttribute("aria-label", "Camera");
    this.image = document.createElement("img");
    this.image.className = "camera-picture";
    this.image.hidden = true;
    this.caption = document.createElement("figcaption");
    this.figure = document.createElement("figure");
    this.figure.className = "camera";
    this.figure.append(this.select, this.image, this.caption);
    this.select.addEventListener("change", () => this.choose(this.select.value || null));
    this.image.addEventListener("error", () => this.clear("This picture cannot be shown."));
    parent.append(this.figure);
    this.setCameras(cameras, chosen);
  }

  /** Offers other cameras; keeps the chosen one if it is still there. */
  setCameras(cameras, chosen = this.camera) {
    const option = (value, text) => {
      const found = document.createElement("option");
      found.value = value;
      found.textContent = text;
      return found;
    };
    this.select.replaceChildren(
      option("", cameras.length ? "no camera" : "there are no cameras"),
      ...cameras.map((camera) => option(camera, camera)),
    );
    this.select.disabled = !cameras.length;
    const next = cameras.includes(chosen) ? chosen : null;
    this.select.value = next ?? "";
    if (next !== this.camera) this.choose(next);
  }

  choose(camera) {
    this.camera = camera;
    this.clear(camera === null ? "" : "No picture yet.");
    this.onChoose(camera);
  }

  /**
   * Shows a picture, if it is of the chosen camera.
   * @param {{camera: string, time_s: number}} about @param {Blob} blob
   */
  show({ camera, time_s }, blob) {
    if (camera !== this.camera) return;
    const before = this.url;
    this.url = URL.createObjectURL(blob);
    this.image.src = this.url;
    this.image.alt = `What ${camera} sees at ${time_s.toFixed(2)} s`;
    this.image.hidden = false;
    this.caption.textContent = `${time_s.toFixed(2)} s`;
    if (before) URL.revokeObjectURL(before);
  }

  clear(text) {
    if (this.url) URL.revokeObjectURL(this.url);
    this.url = "";
    this.image.hidden = true;
    this.image.removeAttribute("src");
    this.caption.textContent = text;
  }

  destroy() {
    this.clear("");
    this.figure.remove();
  }
}
