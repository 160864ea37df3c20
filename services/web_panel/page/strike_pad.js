// The strike pad: the head from above, struck where it is touched, and by the digits of the keyboard. Runs once, for
// one element. A strike goes out when the finger, pen or button comes down: however short the touch, it counts.
((pad) => {
  if (pad.isReady) return;
  pad.isReady = true;
  const AGAIN_MS = 1000, SHOWN_MS = 4000, KEY_STEP = 0.1, MOST_WAITING = 4096;
  // A pointer that rests strikes at STILL; one that comes at FAST radii a second, over the last PATH_MS, at 1.
  const STILL = 0.5, FAST = 8, PATH_MS = 80, SOFT = 0.2, SPACE = 0.7, SOFTEST = 0.02;
  const dot = pad.querySelector("b"), words = pad.parentElement.querySelector("[data-words]"), usual = words.textContent;
  const gone = new AbortController(), signal = gone.signal;
  let socket = null, x = 0.5, y = 0, path = [], shown = 0;

  const say = (text) => {
    clearTimeout(shown);
    words.textContent = text;
    shown = setTimeout(() => { words.textContent = usual; }, SHOWN_MS);
  };
  const connect = () => {
    if (socket && socket.readyState <= WebSocket.OPEN) return;
    // Behind a proxy the page has come by https, and may open no other socket than wss.
    socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/strike`);
    socket.addEventListener("open", () => { pad.dataset.open = ""; }, { signal });
    socket.addEventListener("message", (event) => say(event.data), { signal });
  };
  const show = () => {
    dot.style.left = `${50 + 50 * x}%`;
    dot.style.top = `${50 - 50 * y}%`;
  };
  const send = (level) => {
    const open = socket && socket.readyState === WebSocket.OPEN && socket.bufferedAmount <= MOST_WAITING;
    if (open) socket.send(JSON.stringify([x, y, level]));
    else say("No connection: nothing was struck");
    return open;
  };
  const strike = (level) => {
    if (!send(Math.min(Math.max(level, SOFTEST), 1))) return;
    dot.animate([{ transform: `scale(${1 + 2 * level})`, opacity: 1 }, {}], 200);
  };
  const place = (right, up) => {
    const far = Math.max(Math.hypot(right, up), 1);
    [x, y] = [right / far, up / far];
    show();
  };
  const spot = (event) => {
    const box = pad.getBoundingClientRect();
    return [(2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height];
  };
  // Radii a second at which the pointer came.
  const speed = (event, right, up) => {
    const first = path.find((point) => event.timeStamp - point.at <= PATH_MS);
    if (!first || event.timeStamp - first.at < 1) return 0;
    return (1000 * Math.hypot(right - first.right, up - first.up)) / (event.timeStamp - first.at);
  };
  // A mouse says 0.5, and so does much that feels no pressure; a touch without it says 0 or 1.
  const feels = (event) => event.pointerType !== "mouse" && ![0, 0.5, 1].includes(event.pressure);
  const level = (event, right, up) => {
    if (event.shiftKey) return 1;
    if (event.altKey) return SOFT;
    if (feels(event)) return event.pressure;
    return STILL + (1 - STILL) * Math.min(speed(event, right, up) / FAST, 1);
  };

  pad.addEventListener("pointermove", (event) => {
    const [right, up] = spot(event);
    path = [...path.filter((point) => event.timeStamp - point.at <= PATH_MS), { at: event.timeStamp, right, up }];
  });
  pad.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    pad.focus({ preventScroll: true });
    event.preventDefault();
    const [right, up] = spot(event);
    place(right, up);
    strike(level(event, right, up));
  });
  pad.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (step) place(x + KEY_STEP * step[0], y + KEY_STEP * step[1]);
    else if (event.key !== " " && event.key !== "Enter") return;
    else if (!event.repeat) strike(event.shiftKey ? 1 : SPACE);
    event.preventDefault();
    event.stopPropagation();
  });
  const isWriting = (element) => element?.closest?.("input, textarea, select, [contenteditable]");
  document.addEventListener("keydown", (event) => {
    const digit = /^(?:Digit|Numpad)(\d)$/.exec(event.code), chokes = event.key.toLowerCase() === "c"; // Caps Lock makes it C
    if (!pad.isConnected || !(digit || chokes) || event.repeat) return;
    if (event.ctrlKey || event.metaKey || event.altKey || isWriting(event.target)) return;
    event.preventDefault();
    if (chokes) send(0); // a hand on the head
    else strike((Number(digit[1]) || 10) / 10);
  }, { signal });
  // viser takes the pad off the page without a word, and puts another one there.
  const care = setInterval(() => {
    if (pad.isConnected) connect();
    else {
      clearInterval(care);
      gone.abort();
      socket.close();
    }
  }, AGAIN_MS);
  connect();
  show();
})(this.parentElement)
