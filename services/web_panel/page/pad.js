// The pad: where the pointer wants the stick, sent to the panel while it is held. Runs once, for one element.
((pad) => {
  if (pad.isReady) return;
  pad.isReady = true;
  const PERIOD_MS = 16, AGAIN_MS = 1000, KEY_STEP = 0.1, MOST_WAITING = 4096;
  const dot = pad.querySelector("b"), words = pad.querySelector("[data-words]"), usual = words.textContent;
  const gone = new AbortController(), signal = gone.signal;
  let socket = null, timer = 0, held = false, lift = 1, x = 0;

  const within = (value, low, high) => Math.min(Math.max(value, low), high);
  const connect = () => {
    if (socket && socket.readyState <= WebSocket.OPEN) return;
    // Behind a proxy the page has come by https, and may open no other socket than wss.
    socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/pointer`);
    socket.addEventListener("open", () => { words.textContent = usual; }, { signal });
    socket.addEventListener("close", (event) => {
      words.textContent = `No connection, the stick does not follow. ${event.reason}`.trim();
    }, { signal });
  };
  const send = () => {
    if (socket && socket.readyState === WebSocket.OPEN && socket.bufferedAmount < MOST_WAITING)
      socket.send(JSON.stringify([held, lift, x]));
  };
  const show = () => {
    dot.style.left = `${50 + 50 * x}%`;
    dot.style.top = `${100 - 100 * lift}%`;
    pad.toggleAttribute("data-held", held);
  };
  const release = () => {
    if (!held) return;
    held = false;
    lift = 1;
    clearInterval(timer);
    send();
    show();
  };
  // viser takes the pad off the page without a word, and puts another one there when it is wanted again.
  const leave = () => {
    release();
    clearInterval(care);
    gone.abort();
    socket.close();
  };
  const care = setInterval(() => (pad.isConnected ? connect() : leave()), AGAIN_MS);
  // A pointer that rests sends no events: so the present place is sent again and again for as long as it is held.
  const repeat = () => (pad.isConnected ? send() : leave());
  const hold = () => {
    if (!held) timer = setInterval(repeat, PERIOD_MS);
    held = true;
    repeat();
    show();
  };
  const place = (event) => {
    const box = pad.getBoundingClientRect();
    x = within((2 * (event.clientX - box.left)) / box.width - 1, -1, 1);
    lift = within(1 - (event.clientY - box.top) / box.height, 0, 1);
  };

  pad.addEventListener("pointerdown", (event) => {
    if (event.button !== 0 || !event.isPrimary) return;
    pad.setPointerCapture(event.pointerId);
    pad.focus({ preventScroll: true });
    event.preventDefault();
    place(event);
    hold();
  });
  pad.addEventListener("pointermove", (event) => {
    if (!held || !pad.hasPointerCapture(event.pointerId)) return;
    place(event);
    show();
  });
  for (const kind of ["pointerup", "pointercancel", "lostpointercapture", "blur"])
    pad.addEventListener(kind, release);
  pad.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: -KEY_STEP, ArrowRight: KEY_STEP }[event.key];
    if (step !== undefined) {
      x = within(x + step, -1, 1);
      show();
    } else if (event.key === " " || event.key === "Enter") {
      lift = 0;
      hold();
    } else return;
    event.preventDefault();
    event.stopPropagation();
  });
  pad.addEventListener("keyup", (event) => {
    if (event.key === " " || event.key === "Enter") release();
  });
  document.addEventListener("visibilitychange", release, { signal });
  window.addEventListener("pagehide", release, { signal });
  connect();
  show();
})(this)
