// Stick and drum over the whole screen, by WebGL without any library. It only listens: the panel closes a page that
// sends anything. z points up, the head is at z = 0, its radius is 1, the player sits at negative y.
((page) => {
  const DELAY_MS = 100;  // behind the stick: what lies between two places must be known when it is shown
  const SILENT_MS = 2000, AGAIN_MS = 1000;
  const APART_MS = 100;  // places further apart: some were lost, and a curve between them would swing
  const FLASHES = 12, KEPT = 96, SPOKES = 72;
  const canvas = document.querySelector("canvas"), words = document.querySelector("#words");
  history.replaceState(null, "", location.pathname);  // the audience need not read the token
  document.addEventListener("click", () => document.documentElement.requestFullscreen());

  let places = [], flashes = [], shape = null, told = { words: "", mood: "wait" }, why = "";
  let heardAt = performance.now(), clock = Infinity;  // clock: this one minus the servo's, of the quickest frame

  const take = (frame) => {
    const now = heardAt = performance.now();
    told = frame;
    why = "";
    if (JSON.stringify(frame.stick) !== JSON.stringify(shape)) setStick(shape = frame.stick);
    const newest = frame.places.at(-1)?.[0];
    if (newest === undefined) return;
    if (Math.abs(now - newest - clock) > 1000) {  // the first frame, or the servo's machine started anew
      clock = now - newest;
      places = [];
      flashes = [];
    }
    clock = Math.min(clock + 0.02, now - newest);  // it may drift by 0.6 ms a second
    places = [...places, ...frame.places].sort((a, b) => a[0] - b[0]).slice(-KEPT);
    flashes = [...flashes, ...frame.flashes].slice(-FLASHES);
  };
  const connect = () => {
    const socket = new WebSocket(location.origin.replace("http", "ws") + page.dataset.state);
    socket.onmessage = (event) => take(JSON.parse(event.data));
    socket.onclose = (event) => {
      why = event.reason || why;  // too many pages, or a login that has ended: kept while it is refused again
      setTimeout(connect, AGAIN_MS);
    };
  };

  // Between two places: across the head and the hand evenly, the height by the cubic that has the speeds of both.
  const mix = (a, b, u) => a.map((value, i) => value + (b[i] - value) * u);
  const stickAt = (time) => {
    const next = places.findIndex((place) => place[0] > time);
    if (next <= 0) return places.at(next)?.slice(1);
    const [at, tip, v, grip] = places[next - 1], [end, tip2, v2, grip2] = places[next];
    const ms = end - at, u = (time - at) / ms, s = ms / 1000, w = 1 - u;
    const where = mix(tip, tip2, u);
    if (ms < APART_MS) {
      where[2] = (1 + 2 * u) * w * w * tip[2] + u * w * w * s * v + u * u * (3 - 2 * u) * tip2[2] - u * u * w * s * v2;
    }
    return [where, v, mix(grip, grip2, u)];
  };

  const gl = canvas.getContext("webgl", { antialias: true });
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const less = (a, b) => a.map((value, i) => value - b[i]);
  const unit = (a) => a.map((value) => value / Math.hypot(...a));
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

  const VERTEX = `
    attribute vec3 place, normal, colour;
    uniform mat4 camera; uniform mat3 turn; uniform vec3 at, tip; uniform float isHead;
    varying vec3 p, n, c;
    void main() {
      p = turn * place + at; n = turn * normal; c = colour;
      p.z += isHead * min(tip.z, 0.0) * exp(-4.0 * distance(p.xy, tip.xy)) * (1.0 - dot(p.xy, p.xy));
      gl_Position = camera * vec4(p, 1.0);
    }`;
  const FRAGMENT = `
    precision highp float;
    uniform vec3 eye, tip, end; uniform float isHead, shine, width; uniform vec4 flash[${FLASHES}];
    varying vec3 p, n, c;
    const vec3 SUN = vec3(-0.40, 0.28, 0.87);
    vec3 onHead(vec3 a) { return a - SUN * (a.z / SUN.z); }
    void main() {
      vec3 look = normalize(eye - p), face = normalize(n);
      if (dot(face, look) < 0.0) face = -face;
      vec3 light = c * (0.30 + 0.16 * face.z + 0.62 * max(dot(face, SUN), 0.0));
      light += c * 0.30 * max(dot(face, normalize(vec3(0.9, -0.5, 0.25))), 0.0);
      light += shine * pow(max(dot(reflect(-look, face), SUN), 0.0), 28.0);
      light += shine * 0.25 * pow(1.0 - max(dot(look, face), 0.0), 3.0);
      if (isHead > 0.5) {
        light *= 1.05 - 0.30 * dot(p.xy, p.xy);
        vec3 a = onHead(tip), along = onHead(end) - a;
        float u = clamp(dot(p.xy - a.xy, along.xy) / dot(along.xy, along.xy), 0.0, 1.0);
        float high = mix(tip.z, end.z, u), soft = width + 0.16 * max(high, 0.0);
        float away = distance(p.xy, a.xy + u * along.xy);
        light *= 1.0 - 0.60 * (width / soft) * exp(-away * away / (soft * soft));
        // The largest, not the sum, and slow to fade: a roll glows and does not flicker.
        float glow = 0.0, rings = 0.0;
        for (int i = 0; i < ${FLASHES}; i++) {
          float d = distance(p.xy, flash[i].xy), age = flash[i].z, level = flash[i].w;
          if (age < 0.0) continue;
          float size = 0.14 + 0.30 * level, ring = (d - 1.5 * age) / 0.03;
          glow = max(glow, (0.75 + 0.25 * level) * exp(-3.0 * age) * exp(-d * d / (size * size)));
          rings = max(rings, sqrt(level) * exp(-4.0 * age - ring * ring));
        }
        light = mix(light, vec3(1.0, 0.56, 0.10), min(0.95 * glow + 0.45 * rings, 1.0));
      }
      gl_FragColor = vec4(pow(light, vec3(0.9)), 1.0);
    }`;

  // A surface of revolution about z: strips of rows (height, radius), each smooth along itself and of one colour.
  const revolved = (strips, spokes = SPOKES) => {
    const corners = [], faces = [];
    for (const { rows, colour } of strips) {
      const first = corners.length / 9;
      rows.forEach(([z, r], row) => {
        const [z0, r0] = rows[Math.max(row - 1, 0)], [z1, r1] = rows[Math.min(row + 1, rows.length - 1)];
        const [nr, nz] = unit([z1 - z0, r0 - r1]);
        for (let spoke = 0; spoke <= spokes; spoke++) {
          const x = Math.cos(2 * Math.PI * spoke / spokes), y = Math.sin(2 * Math.PI * spoke / spokes);
          corners.push(r * x, r * y, z, nr * x, nr * y, nz, ...colour);
          if (row === 0 || spoke === 0) continue;
          const here = first + row * (spokes + 1) + spoke, below = here - spokes - 1;
          faces.push(below - 1, below, here, below - 1, here, here - 1);
        }
      });
    }
    const buffers = [gl.ARRAY_BUFFER, gl.ELEMENT_ARRAY_BUFFER].map((kind, i) => {
      const buffer = gl.createBuffer();
      gl.bindBuffer(kind, buffer);
      gl.bufferData(kind, i ? new Uint16Array(faces) : new Float32Array(corners), gl.STATIC_DRAW);
      return buffer;
    });
    return { buffers, count: faces.length };
  };
  const MAPLE = [0.93, 0.74, 0.47], LACQUER = [0.52, 0.10, 0.09], CHROME = [0.62, 0.64, 0.68];
  let drum = [], stick = null, program, uniform;
  const setStick = (given) => {
    stick = gl && given && revolved([
      { rows: given[1], colour: [0.99, 0.90, 0.70] }, { rows: given[2], colour: MAPLE },
      { rows: given[3], colour: [0.10, 0.32, 0.46] }, { rows: given[4], colour: [0.74, 0.50, 0.27] },
    ], 24);
  };
  const setUp = () => {
    program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    ["place", "normal", "colour"].forEach((name, i) => {
      gl.bindAttribLocation(program, i, name);
      gl.enableVertexAttribArray(i);
    });
    gl.linkProgram(program);
    gl.useProgram(program);
    gl.enable(gl.DEPTH_TEST);
    uniform = (name) => gl.getUniformLocation(program, name);
    const one = (rows, colour) => ({ rows, colour });
    const hoop = (low, high) => [
      one([[low, 1.03], [low, 1.075]], CHROME), one([[low, 1.075], [high - 0.02, 1.075]], CHROME),
      one([[high - 0.02, 1.075], [high - 0.005, 1.068], [high, 1.05], [high - 0.005, 1.032], [high - 0.02, 1.025]], CHROME),
      one([[high - 0.02, 1.025], [low, 1.025]], CHROME),
    ];
    const head = Array.from({ length: 41 }, (_, i) => [0, 1.03 * (1 - i / 40)]);
    const rod = [one([[-0.60, 0], [-0.60, 0.014], [-0.04, 0.014], [-0.04, 0]], CHROME)];
    const lug = [one([[-0.44, 0], [-0.44, 0.03], [-0.43, 0.036], [-0.21, 0.036], [-0.20, 0.03], [-0.20, 0]], CHROME)];
    drum = [
      { mesh: revolved([one(head, [0.76, 0.73, 0.67])]), isHead: 1, shine: 0.05 },
      { mesh: revolved([one([[-0.60, 1], [-0.04, 1]], LACQUER)]), shine: 0.55 },
      { mesh: revolved([...hoop(-0.10, 0.05), ...hoop(-0.64, -0.54)]), shine: 0.6 },
    ];
    const lugs = [revolved(rod, 12), revolved(lug, 16)];
    for (let i = 0; i < 10; i++) {
      const angle = 2 * Math.PI * (i + 0.5) / 10;
      for (const mesh of lugs) drum.push({ mesh, shine: 0.6, at: [1.045 * Math.cos(angle), 1.045 * Math.sin(angle), 0] });
    }
  };

  const EYE = [0.3, -5.4, 3.4], TARGET = [0.3, -0.24, -0.22], NEAR = 0.5, FAR = 20, HALF_WIDTH = 0.31, HALF_HEIGHT = 0.195;
  const cameraOf = (aspect) => {
    const back = unit(less(EYE, TARGET)), right = unit(cross([0, 0, 1], back)), up = cross(back, right);
    const f = 1 / Math.max(HALF_HEIGHT, HALF_WIDTH / aspect), depth = (FAR + NEAR) / (NEAR - FAR);
    const rows = [
      [...right.map((x) => x * f / aspect), -dot(right, EYE) * f / aspect], [...up.map((x) => x * f), -dot(up, EYE) * f],
      [...back.map((x) => x * depth), -dot(back, EYE) * depth + 2 * FAR * NEAR / (NEAR - FAR)],
      [...back.map((x) => -x), dot(back, EYE)],
    ];
    return [0, 1, 2, 3].flatMap((column) => rows.map((row) => row[column]));
  };
  const UPRIGHT = [1, 0, 0, 0, 1, 0, 0, 0, 1];
  const drawPart = ({ mesh, isHead = 0, shine, at = [0, 0, 0], turn = UPRIGHT }) => {
    gl.uniformMatrix3fv(uniform("turn"), false, turn);
    gl.uniform3fv(uniform("at"), at);
    gl.uniform1f(uniform("isHead"), isHead);
    gl.uniform1f(uniform("shine"), shine);
    gl.bindBuffer(gl.ARRAY_BUFFER, mesh.buffers[0]);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, mesh.buffers[1]);
    for (let i = 0; i < 3; i++) gl.vertexAttribPointer(i, 3, gl.FLOAT, false, 36, 12 * i);
    gl.drawElements(gl.TRIANGLES, mesh.count, gl.UNSIGNED_SHORT, 0);
  };
  const draw = (time) => {
    const scale = Math.min(devicePixelRatio, 2);
    const [width, height] = [canvas.clientWidth * scale, canvas.clientHeight * scale].map(Math.round);
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    gl.viewport(0, 0, width, height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const seen = stick && stickAt(time);
    const [tip, , grip] = seen ?? [[0, 0, 9], 0, [1, 0, 9]];
    const along = unit(less(grip, tip)), side = unit(cross([0, 0, 1], along)), up = cross(along, side);
    const bead = shape?.[0] ?? 0, butt = shape?.[4].at(-1)[0] ?? 1;
    const start = [tip[0], tip[1], tip[2] + bead].map((value, i) => value - along[i] * shape?.[1][4][0] || 0);
    gl.uniformMatrix4fv(uniform("camera"), false, cameraOf(width / height));
    gl.uniform3fv(uniform("eye"), EYE);
    gl.uniform3fv(uniform("tip"), tip);
    gl.uniform3fv(uniform("end"), tip.map((value, i) => value + along[i] * butt));
    gl.uniform1f(uniform("width"), 1.3 * bead + 0.001);
    const rows = flashes.map(([at, x, y, level]) => [x, y, (time - at) / 1000, level]);
    while (rows.length < FLASHES) rows.push([0, 0, -1, 0]);
    gl.uniform4fv(uniform("flash"), rows.flat());
    drum.forEach(drawPart);
    if (seen) drawPart({ mesh: stick, shine: 0.18, at: start, turn: [...side, ...up, ...along] });
  };

  const show = () => {
    const now = performance.now(), cutOff = now - heardAt > SILENT_MS;
    const said = cutOff ? why || page.dataset.cutOff : told.words || (gl ? "" : page.dataset.noWebgl);
    if (words.textContent !== said) words.textContent = said;
    document.body.dataset.mood = cutOff ? "bad" : told.mood;
    if (gl) draw(now - clock - DELAY_MS);
    requestAnimationFrame(show);
  };
  canvas.addEventListener("webglcontextlost", () => location.reload());
  if (gl) setUp();
  connect();
  show();
})(document.currentScript);
