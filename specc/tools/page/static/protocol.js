/**
 * The messages between page and server, and the connection that carries them.
 *
 * @typedef {{name: string, title: string, id: string, is_error: boolean, modes: string[],
 *   place: string}} State
 * @typedef {{label: string, id: string, source: string, target: string, cause: string,
 *   place: string}} Row
 * @typedef {{name: string, title: string, period_s: number, svg: string|null, states: State[],
 *   rows: Row[]}} Machine
 * @typedef {{name: string, unit: string, words: string[]}} Component
 * @typedef {{name: string, title: string, unit: string,
 *   kind: "numbers"|"state"|"pose"|"other", components: Component[]}} Signal
 * @typedef {{name: string, title: string, unit: string, hold: boolean, key: string,
 *   kind: "button"|"switch"|"slider"|"choice"|"number", initial: any, least?: number,
 *   greatest?: number, whole?: boolean, choices?: string[]}} PanelElement
 * @typedef {{name: string, unit: string, least: number, greatest: number, value: number,
 *   whole: boolean}} LiveConstant
 *
 * @typedef {{type: "hello", source: "live"|"file", file?: string, title: string, system: string,
 *   seed: number, real_time: boolean, begin_s: number, repeats_until_s?: number,
 *   end_s: number|null, end?: End|null, notice: string[],
 *   machines: Machine[], structure: string|null, signals: Signal[], usual: string[],
 *   requirements: {that: string, because: string, place: string, constants: Object<string, string>,
 *   reasons?: string[]}[], cameras: string[],
 *   frames: string[], poses: {name: string, base: string, end: string}[],
 *   carriers: Object<string, string>, scene: string|null, bodies: string[],
 *   constants: {name: string, text: string, unit: string}[], live: LiveConstant[],
 *   panel: PanelElement[], can: Object<string, boolean>, controls: boolean}} Hello
 *   What is shown; it comes again when the run starts again.
 *
 * @typedef {{state: string, since_s: number|null, row: string}} Standing
 * @typedef {{verdict: "holds"|"violated"|"open"|"unknown", margin: number|null,
 *   time_s: number|null}} Verdict
 * @typedef {{type: "now", time_s: number, status: "running"|"paused"|"ended",
 *   speed: number|null, factor: number|null, wall_s?: number, flow: string[],
 *   states: Object<string, Standing>,
 *   requirements?: Verdict[], poses: number[][]|null, live: Object<string, number>,
 *   panel: Object<string, any>,
 *   real_time?: Object<string, {late_ms: number, skipped: number}>}} Now
 *   The latest moment of a run, or the end of a recording. What is missing has not changed.
 * @typedef {{type: "moment", id: number, time_s: number, states: Object<string, Standing>,
 *   values: Object<string, string>, requirements: Verdict[], poses: number[][]|null,
 *   frames?: Object<string, number[]>,
 *   flow: string[]}} Moment The answer to `look`.
 * @typedef {{text: string, depth: number, truth: boolean|null, place: string|null,
 *   role: "state"|"row"|"condition"|"reason"|"read"|"sent"|"past"|"fault",
 *   name: string|null}} WhyLine
 *   `name` is the condition's or the row's, as a breakpoint takes it.
 * @typedef {{type: "why", id: number, machine: string, time_s: number, lines: WhyLine[]}} Why
 * @typedef {{type: "series", id: number, name: string, begin_s: number, end_s: number,
 *   t: number[], lines: (number|null)[][], words: string[]}} Series
 * @typedef {{ended: string, exit_code: number,
 *   report?: {faults: {culprit: string, message: string, time_s: number}[]}}} End
 * @typedef {[number, number|null, string]} Span Begin, end or null, and state.
 * @typedef {{time_s: number, text: string, kind: "fault"|"violation"|"disturbance"|"change"|
 *   "panel"|"cycle"|"break"|"lost"}} Mark
 * @typedef {{id: string, kind: "state"|"row"|"condition"|"requirement"|"sent", machine?: string,
 *   state?: string, row?: string, condition?: string, that?: string, element?: string,
 *   op?: string, value?: number, item?: number}} Breakpoint
 */

const SLOWEST_MS = 4000;

/** A WebSocket that connects again when it was lost. */
export class Connection {
  /**
   * @param {(message: any) => void} receive
   * @param {(blob: Blob, about: any) => void} receivePicture
   * @param {(is_open: boolean) => void} change
   */
  constructor(receive, receivePicture, change) {
    this.receive = receive;
    this.receivePicture = receivePicture;
    this.change = change;
    this.delay_ms = 500;
    this.open();
  }

  open() {
    const scheme = location.protocol === "https:" ? "wss:" : "ws:";
    this.socket = new WebSocket(`${scheme}//${location.host}/ws`);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => {
      this.delay_ms = 500;
      this.change(true);
    };
    this.socket.onmessage = (event) => this.take(event.data);
    this.socket.onclose = () => {
      this.change(false);
      setTimeout(() => this.open(), this.delay_ms);
      this.delay_ms = Math.min(SLOWEST_MS, 2 * this.delay_ms);
    };
  }

  take(data) {
    if (typeof data === "string") {
      this.receive(JSON.parse(data));
      return;
    }
    const length = new DataView(data).getUint32(0);
    const about = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
    this.receivePicture(new Blob([new Uint8Array(data, 4 + length)]), about);
  }

  get isOpen() {
    return this.socket.readyState === WebSocket.OPEN;
  }

  send(message) {
    if (this.isOpen) {
      this.socket.send(JSON.stringify(message));
    }
  }
}
