// The page's side of the live view of notebooks, a module of anywidget: shows the frames that
// Python passes on and sends gestures. (relay.py has the messages.)
const zoomPerPixel = 1.0015;
const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
const arrowPixels = 24;

const element = (name, style, attributes = {}) => {
  const made = document.createElement(name);
  Object.assign(made.style, style);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
};

// Sends at most one message of each kind for each frame of the display, so that a fast pointer does
// not fill the channel; what was gathered in between is added up.
function gatherer(send) {
  const waiting = new Map();
  let asked = 0;
  const flush = () => {
    asked = 0;
    for (const message of waiting.values()) send(message);
    waiting.clear();
  };
  return {
    add(message, join) {
      const before = waiting.get(message.type);
      waiting.set(message.type, before ? join(before, message) : message);
      asked ||= requestAnimationFrame(flush);
    },
    stop: () => cancelAnimationFrame(asked),
  };
}

const joinMoves = (a, b) => ({ ...b, dx: a.dx + b.dx, dy: a.dy + b.dy });
const joinZooms = (a, b) => ({ ...b, factor: a.factor * b.factor });

function gestures(picture, add, send) {
  let last = null;
  const move = (pan, dx, dy) => {
    const unit = pan ? 1 / picture.clientHeight : 1;
    add({ type: pan ? "pan" : "orbit", dx: dx * unit, dy: dy * unit }, joinMoves);
  };
  picture.addEventListener("pointerdown", (event) => {
    picture.setPointerCapture(event.pointerId);
    last = { x: event.clientX, y: event.clientY, pan: event.button === 2 || event.shiftKey };
  });
  picture.addEventListener("pointermove", (event) => {
    if (last === null) return;
    const dx = event.clientX - last.x;
    const dy = event.clientY - last.y;
    last = { ...last, x: event.clientX, y: event.clientY };
    move(last.pan, dx, dy);
  });
  for (const type of ["pointerup", "pointercancel"]) {
    picture.addEventListener(type, () => (last = null));
  }
  picture.addEventListener("contextmenu", (event) => event.preventDefault());
  picture.addEventListener("dblclick", () => send({ type: "reset" }));
  // As in the embedded page, the wheel scrolls the notebook until the picture has been chosen.
  picture.addEventListener(
    "wheel",
    (event) => {
      if (document.activeElement !== picture && !event.ctrlKey) return;
      event.preventDefault();
      add({ type: "zoom", factor: zoomPerPixel ** -event.deltaY }, joinZooms);
    },
    { passive: false },
  );
  picture.addEventListener("keydown", (event) => {
    const arrow = arrows[event.key];
    if (arrow) {
      const [dx, dy] = arrow.map((way) => way * arrowPixels);
      move(event.shiftKey, dx, dy);
    } else if (event.key === "+" || event.key === "-") {
      add({ type: "zoom", factor: event.key === "+" ? 1.15 : 1 / 1.15 }, joinZooms);
    } else if (event.key === "0") {
      send({ type: "reset" });
    } else {
      return;
    }
    event.preventDefault();
  });
}

function stepControl(steps, send) {
  const row = element("div", { display: "flex", gap: "8px", alignItems: "center", padding: "4px" });
  const slider = element(
    "input",
    { flex: "1" },
    {
      type: "range",
      min: "0",
      max: String(steps.length - 1),
      value: "0",
      "aria-label": "time step",
    },
  );
  const text = element("output", { font: "12px sans-serif", minWidth: "12em" });
  const tell = (step) => {
    slider.value = String(step);
    text.textContent = steps[step] ?? "";
    slider.setAttribute("aria-valuetext", text.textContent);
  };
  slider.addEventListener("input", () => {
    tell(Number(slider.value));
    send({ type: "step", step: Number(slider.value) });
  });
  row.append(slider, text);
  return { row, tell };
}

function render({ model, el }) {
  const send = (message) => model.send(message);
  const picture = element(
    "canvas",
    { width: "100%", height: `${model.get("height")}px`, display: "block", background: "#000" },
    { tabindex: "0", role: "img", "aria-label": `live view of ${model.get("title")}` },
  );
  picture.style.touchAction = "none";
  const alarm = element("div", { font: "12px sans-serif", color: "#b00020" }, { role: "alert" });
  const steps = model.get("steps");
  const time = stepControl(steps, send);
  el.append(picture, alarm);
  if (steps.length > 1) el.append(time.row);
  const gathered = gatherer(send);
  gestures(picture, gathered.add, send);

  const draw = async (message, data) => {
    try {
      const bitmap = await createImageBitmap(new Blob([data], { type: message.mime }));
      // The buffer has the pixels of the frame; the page scales it to the size of the widget.
      picture.width = bitmap.width;
      picture.height = bitmap.height;
      picture.getContext("2d").drawImage(bitmap, 0, 0);
      bitmap.close();
      picture.dataset.seq = String(message.seq);
      picture.dataset.final = String(message.final);
      time.tell(message.step);
      alarm.textContent = "";
    } finally {
      send({ type: "shown", seq: message.seq });
    }
  };
  const receive = (message, buffers) => {
    if (message.type === "frame") {
      draw(message, buffers[0]).catch(() => (alarm.textContent = "a frame cannot be decoded"));
    } else if (message.type === "problem") {
      alarm.textContent = message.detail;
    }
  };
  model.on("msg:custom", receive);
  const resized = new ResizeObserver(() => {
    const width = Math.round(picture.clientWidth * window.devicePixelRatio);
    const height = Math.round(picture.clientHeight * window.devicePixelRatio);
    if (width > 0 && height > 0) gathered.add({ type: "size", width, height }, (_, now) => now);
  });
  send({ type: "ready" });
  resized.observe(picture);
  return () => {
    resized.disconnect();
    gathered.stop();
    model.off("msg:custom", receive);
    send({ type: "close" });
  };
}

export default { render };
