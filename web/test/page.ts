// The app in a simulated document with parts that record their calls: the messages it sends and the
// state it shows, for the server messages of a test. No browser, no server.
import { App } from "../src/app/app";
import type { AppParts } from "../src/app/app_parts";
import { DatasetList } from "../src/app/dataset_list";
import type {
  ClientMessage,
  Dataset,
  DatasetSummary,
  ServerMessage,
  View,
} from "@windsplat/client";
import { Status } from "../src/app/status";
import { TimeBar } from "../src/app/time_bar";
import type { DrawnFrame } from "@windsplat/client/parts";

class Element {
  dataset: Record<string, string> = {};
  textContent = "";
  title = "";
  value = "";
  hidden = true;
  checked = true;
  disabled = false;
  inert = false;
  max = "";
  children: Element[] = [];
  style = { setProperty: () => {} };
  readonly attributes = new Map<string, string>();
  readonly classes = new Set<string>();
  readonly classList = {
    add: (name: string) => void this.classes.add(name),
    remove: (name: string) => void this.classes.delete(name),
    toggle: (name: string, on: boolean) =>
      on ? this.classes.add(name) : this.classes.delete(name),
  };
  private readonly handlers = new Map<string, () => void>();

  addEventListener(type: string, run: () => void): void {
    this.handlers.set(type, run);
  }

  fire(type: string): void {
    this.handlers.get(type)?.();
  }

  setAttribute(name: string, value: string): void {
    this.attributes.set(name, value);
  }

  removeAttribute(name: string): void {
    this.attributes.delete(name);
  }

  replaceChildren(...children: Element[]): void {
    this.children = children;
  }
}

class Socket {
  static last: Socket;
  readyState = 1;
  bufferedAmount = 0;
  binaryType = "";
  sent: ClientMessage[] = [];
  onmessage: ((event: { data: string }) => void) | null = null;
  onclose: ((event: { code: number; reason: string }) => void) | null = null;

  constructor() {
    Socket.last = this;
  }

  send(text: string): void {
    this.sent.push(JSON.parse(text) as ClientMessage);
  }

  close(): void {}
}

// State of the newest page: pending timers, and handlers of visibility changes.
let timers: (() => void)[] = [];
let visibilityHandlers: (() => void)[] = [];

// Returns simulated elements that pass byId's type check, whatever type it requests.
function standIn(): (id: string) => Element {
  const elements = new Map<string, Element>();
  const byId = (id: string): Element => {
    const element = elements.get(id) ?? new Element();
    elements.set(id, element);
    return element;
  };
  timers = [];
  visibilityHandlers = [];
  const noTimers = { setTimeout: () => 0, clearTimeout: () => {}, setInterval: () => 0 };
  const names = ["Element", "InputElement", "ButtonElement", "SelectElement", "ProgressElement"];
  Object.assign(globalThis, Object.fromEntries(names.map((name) => [`HTML${name}`, Element])), {
    Option: class extends Element {
      constructor(text: string, value: string) {
        super();
        Object.assign(this, { textContent: text, value });
      }
    },
    WebSocket: Socket,
    fetch: () => Promise.reject(new Error("offline")),
    document: {
      title: "",
      hidden: false,
      documentElement: new Element(),
      getElementById: byId,
      addEventListener: (type: string, run: () => void) => {
        if (type === "visibilitychange") visibilityHandlers.push(run);
      },
    },
    window: {
      ...noTimers,
      clearInterval: () => {},
      addEventListener: () => {},
      location: { hash: "" },
      history: { replaceState: () => {} },
    },
  });
  return byId;
}

const fieldOf = (name: string): Dataset["fields"][number] => ({
  name,
  kind: name === "wind" ? "vector" : "scalar",
  components: name === "wind" ? ["u", "v", "w"] : [name],
  units: name === "wind" ? "m s-1" : "K",
  standardName: "",
  longName: "",
  range: [0, 30],
  masked: 0,
  rangeOf: "step",
  dtype: "float32",
});

const axisOf = (name: string, count: number) => ({
  name,
  standardName: "",
  units: "m",
  kind: "cartesian" as const,
  coordinates: Array.from({ length: count }, (_, n) => n),
  world: Array.from({ length: count }, (_, n) => n / count),
});

// A dataset description as the server sends it.
export function described(
  id: string,
  { steps = 5, fields = ["wind", "temperature"], size = 4, ...more }: Described = {},
): Dataset {
  const camera = { eye: [0, -4, 1], target: [0, 0, 0], up: [0, 0, 1], fovY: 35, height: 2 };
  return {
    id,
    title: `The ${id}`,
    source: `${id}.nc`,
    format: "netCDF-4",
    state: "ready",
    dims: { x: size, y: size, z: size },
    axes: { x: axisOf("x", size), y: axisOf("y", size), z: axisOf("z", size) },
    world: { min: [-1, -1, -1], max: [1, 1, 1] },
    mappings: ["flat"],
    fields: fields.map(fieldOf),
    leftOut: [],
    notes: [],
    choices: [],
    steps: {
      count: steps,
      times: Array.from({ length: steps }, (_, n) => ({
        value: n,
        text: `2001-01-01T0${n}:00:00Z`,
      })),
    },
    timeUnits: "hours since 2001-01-01",
    residentBytes: 0,
    bytesWhenResident: 0,
    defaultView: {
      dataset: id,
      step: 0,
      camera: camera as View["camera"],
      vector: { field: fields.includes("wind") ? "wind" : null },
      scalars: fields.filter((name) => name !== "wind").map((field) => ({ field })),
    },
    ...more,
  };
}

export interface Described extends Partial<Omit<Dataset, "steps" | "fields">> {
  steps?: number;
  fields?: string[];
  size?: number;
}

export const summaryOf = (dataset: Dataset): DatasetSummary => {
  const { id, title, state, fields, residentBytes, notes } = dataset;
  return { id, title, state, fields, steps: dataset.steps.count, residentBytes, notes };
};

export const problem = (detail: string, status = 422, pointer?: string) => ({
  type: "about:blank",
  title: "Unprocessable Content",
  status,
  detail,
  ...(pointer === undefined
    ? {}
    : { errors: [{ pointer, detail }] as [{ pointer: string; detail: string }] }),
});

export interface Drawing {
  rev?: number;
  final?: boolean;
  view?: View;
  empty?: string;
}

export class Page {
  readonly element = standIn();
  readonly app: App;
  built = 0; // number of times the panels were built
  cardsShown = 0; // number of times the cards were shown
  cardsSaid: string[] = []; // reasons why they were shown
  entriesShown: string[] = []; // what the entry picker shows
  entriesRefused = "";
  private seq = 0;
  private socket: Socket;

  // hash: of the address with which the page is opened
  constructor(
    readonly datasets: Dataset[],
    { hash = "" } = {},
  ) {
    window.location.hash = hash;
    const clock = {
      setTimeout: (run: () => void, ms: number) => {
        if (ms < 5000) timers.push(run);
        return timers.length;
      },
      clearTimeout: () => {},
      random: () => 0.5,
    };
    this.app = new App(clock, "http://host/");
    this.app.start(this.parts());
    this.socket = Socket.last;
    this.greet();
  }

  private greet(): void {
    this.receives({
      type: "hello",
      protocol: "windsplat.v1",
      version: "0.1.0",
      session: "1",
      limits: {} as never,
      datasets: this.datasets.map(summaryOf),
    });
  }

  // The connection closes with this code.
  lose(code: number): void {
    this.socket.onclose?.({ code, reason: "" });
  }

  // The connection closes and is reopened.
  again(): void {
    this.socket.onclose?.({ code: 1006, reason: "" });
    for (const run of timers.splice(0)) run();
    this.socket = Socket.last;
    this.seq = 0;
    this.greet();
  }

  // This many bytes are still in the send buffer.
  holdUp(bytes: number): void {
    this.socket.bufferedAmount = bytes;
  }

  hide(hidden: boolean): void {
    Object.assign(document, { hidden });
    for (const run of visibilityHandlers) run();
  }

  private parts(): AppParts {
    const { app } = this;
    const ignore = { show: () => {}, setAxes: () => {}, mark: () => {}, steps: () => {} };
    return {
      viewport: {
        canvas: new Element(),
        size: () => [800, 600],
        askedSize: () => [800, 600],
        newSession: () => {},
      },
      hud: ignore,
      legend: ignore,
      gizmo: ignore,
      beside: { follow: () => {}, suffix: "", take: (hash: string) => hash },
      probe: ignore,
      hover: { refresh: () => {} },
      panels: { build: () => (this.built += 1), refresh: () => {} },
      timeBar: new TimeBar({
        seek: (step) => app.seek(step),
        scrub: (step) => app.playback.scrub(step),
        scrubbed: () => app.playback.scrubbed(),
        play: (direction) => app.playback.play(direction),
        pause: () => app.playback.pause(),
        settings: () => app.playback.again(),
      }),
      status: new Status(),
      login: { ask: () => {}, done: () => {} },
      picker: this.element("dataset"),
      list: new DatasetList(this.element("dataset") as unknown as HTMLSelectElement),
      cards: {
        show: (why?: string) => {
          this.cardsShown += 1;
          if (why !== undefined) this.cardsSaid.push(why);
        },
      },
      entries: {
        show: (choices: Dataset["choices"]) => {
          this.entriesShown = choices.map(({ name, chosen }) => `${name}=${chosen}`);
        },
        refuse: (reason: string) => (this.entriesRefused = reason),
      },
      facts: this.element("facts"),
    } as unknown as AppParts;
  }

  receives(message: ServerMessage): void {
    this.socket.onmessage?.({ data: JSON.stringify(message) });
  }

  // The id of the last `open` message.
  get openId(): number {
    return this.sent("open").at(-1)!.id;
  }

  opened(dataset: Dataset): void {
    this.receives({ type: "opened", id: this.openId, dataset });
  }

  // A frame of the requested view, completed with its defaults and the server's own choices.
  draws({ rev = this.rev, final = true, view: own = {}, empty }: Drawing = {}): void {
    this.seq += 1;
    const view = { ...this.app.view(), ...own };
    this.receives({
      type: "chosen",
      seq: this.seq,
      rev,
      view,
      work: {},
      empty,
    } as unknown as ServerMessage);
    const header = { seq: this.seq, rev, step: view.step ?? 0, final, t: 0 };
    this.app.onDrawn({ header, decodeMs: 1, arrivedAt: 0, drawnAt: 1 } as DrawnFrame);
  }

  sent<T extends ClientMessage["type"]>(type: T): Extract<ClientMessage, { type: T }>[] {
    return this.socket.sent.filter(
      (message): message is Extract<ClientMessage, { type: T }> => message.type === type,
    );
  }

  get rev(): number {
    return this.sent("patch").at(-1)!.rev;
  }

  get alert(): string | null {
    return this.element("alert").hidden ? null : this.element("alert-text").textContent;
  }

  // The text over a picture that shows nothing.
  get emptyText(): string | null {
    return this.element("empty").hidden ? null : this.element("empty").textContent;
  }

  get entries(): string[] {
    return this.element("dataset").children.map((option) => option.textContent);
  }

  choose(id: string): void {
    this.element("dataset").value = id;
    this.element("dataset").fire("change");
  }
}
