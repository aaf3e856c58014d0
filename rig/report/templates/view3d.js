// The interactive view: WebGL 2 where there is any, else triangles painted from far to near.
(() => {
  "use strict";
  const root = document.getElementById("view3d");
  const find = (name) => root.querySelector("." + name);
  const data = JSON.parse(find("data").textContent);
  const canvas = find("live");

  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const triangles = data.wide
    ? new Uint32Array(bytes(data.triangles).buffer)
    : new Uint16Array(bytes(data.triangles).buffer);
  const colours = bytes(data.colours);
  const steps = data.steps.map((step) => ({
    kpa: step.kpa,
    at: new Uint16Array(bytes(step.at).buffer),
    values: step.values.map(bytes),
    peaks: step.peaks,
  }));
  const count = steps[0].at.length / 3;
  const position = new Float32Array(3 * count);
  const normal = new Float32Array(3 * count);
  const value = new Float32Array(count);

  const state = { step: steps.length - 1, quantity: 0, cut: false };
  const view = {};
  const reset = () => Object.assign(view, { yaw: data.yaw, pitch: data.pitch, zoom: 1, x: 0, y: 0 });
  reset();

  // the place to turn about and the size to fit: those of all steps, so that nothing jumps
  const centre = data.low.map((low, i) => (i === data.mirror ? 0 : low + data.size[i] / 2));
  const reach = Math.hypot(
    ...data.size.map((size, i) => (i === data.mirror ? data.low[i] + size : size / 2))
  );

  // positions and colours between two steps, in a straight line
  function pose() {
    const first = Math.min(Math.floor(state.step), steps.length - 1);
    const next = Math.min(first + 1, steps.length - 1);
    const share = state.step - first;
    const a = steps[first], b = steps[next];
    const va = a.values[state.quantity], vb = b.values[state.quantity];
    for (let i = 0; i < 3 * count; i++) {
      const unit = (a.at[i] + share * (b.at[i] - a.at[i])) / 65535;
      position[i] = data.low[i % 3] + data.size[i % 3] * unit - centre[i % 3];
    }
    for (let i = 0; i < count; i++) value[i] = (va[i] + share * (vb[i] - va[i])) / 255;
    normal.fill(0);
    for (let t = 0; t < triangles.length; t += 3) {
      const p = 3 * triangles[t], q = 3 * triangles[t + 1], r = 3 * triangles[t + 2];
      const ux = position[q] - position[p], uy = position[q + 1] - position[p + 1];
      const uz = position[q + 2] - position[p + 2], vx = position[r] - position[p];
      const vy = position[r + 1] - position[p + 1], vz = position[r + 2] - position[p + 2];
      const nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
      for (const k of [p, q, r]) {
        normal[k] += nx;
        normal[k + 1] += ny;
        normal[k + 2] += nz;
      }
    }
  }

  // rows: right, up, towards the viewer
  function rotation() {
    const cy = Math.cos(view.yaw), sy = Math.sin(view.yaw);
    const cp = Math.cos(view.pitch), sp = Math.sin(view.pitch);
    const turn = [cy, 0, sy, sp * sy, cp, -sp * cy, -cp * sy, sp, cp * cy];
    const m = new Float32Array(9);
    for (let i = 0; i < 3; i++)
      for (let j = 0; j < 3; j++)
        for (let k = 0; k < 3; k++) m[3 * i + j] += turn[3 * i + k] * data.frame[3 * k + j];
    return m;
  }

  const scale = () => (1.15 * view.zoom) / reach;
  // whole: the outside and its image; cut open: the half with its cavity and section
  const sides = () => (state.cut || data.mirror === null ? [1] : [1, -1]);
  const shown = () => (state.cut ? triangles.length : data.outside);

  function withGl(gl) {
    const shader = (kind, text) => {
      const made = gl.createShader(kind);
      gl.shaderSource(made, text);
      gl.compileShader(made);
      gl.attachShader(program, made);
    };
    const program = gl.createProgram();
    shader(gl.VERTEX_SHADER, `#version 300 es
      in vec3 position; in vec3 normal; in float value;
      uniform mat3 turn; uniform vec3 side; uniform vec4 fit;
      out vec3 facing; out float shade;
      void main() {
        vec3 place = turn * (position * side);
        facing = turn * (normal * side);
        shade = value;
        gl_Position = vec4((place.xy * fit.z + fit.xy) * vec2(fit.w, 1.0), -place.z * fit.z * 0.2, 1.0);
        if (fit.w > 1.0) gl_Position.xy /= fit.w;
      }`);
    shader(gl.FRAGMENT_SHADER, `#version 300 es
      precision highp float;
      in vec3 facing; in float shade;
      uniform sampler2D colours; uniform float ambient;
      out vec4 colour;
      void main() {
        float light = ambient + (1.0 - ambient) * abs(normalize(facing).z);
        colour = vec4(texture(colours, vec2(shade * 255.0 / 256.0 + 0.5 / 256.0, 0.5)).rgb * light, 1.0);
      }`);
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return null;
    gl.useProgram(program);
    const buffers = [["position", position, 3], ["normal", normal, 3], ["value", value, 1]].map(
      ([name, array, size]) => {
        const where = gl.getAttribLocation(program, name), buffer = gl.createBuffer();
        gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
        gl.enableVertexAttribArray(where);
        gl.vertexAttribPointer(where, size, gl.FLOAT, false, 0, 0);
        return [buffer, array];
      }
    );
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, triangles, gl.STATIC_DRAW);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB, 256, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, colours);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER])
      gl.texParameteri(gl.TEXTURE_2D, name, gl.LINEAR);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T])
      gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
    gl.enable(gl.DEPTH_TEST);
    const at = (name) => gl.getUniformLocation(program, name);
    gl.uniform1f(at("ambient"), data.ambient);
    return (changed) => {
      if (changed)
        for (const [buffer, array] of buffers) {
          gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
          gl.bufferData(gl.ARRAY_BUFFER, array, gl.DYNAMIC_DRAW);
        }
      gl.viewport(0, 0, canvas.width, canvas.height);
      gl.clearColor(0, 0, 0, 0);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      gl.uniformMatrix3fv(at("turn"), true, rotation());
      gl.uniform4f(at("fit"), view.x, view.y, scale(), canvas.height / canvas.width);
      for (const sign of sides()) {
        gl.uniform3f(at("side"), ...[0, 1, 2].map((i) => (i === data.mirror ? sign : 1)));
        const kind = data.wide ? gl.UNSIGNED_INT : gl.UNSIGNED_SHORT;
        gl.drawElements(gl.TRIANGLES, shown(), kind, 0);
      }
    };
  }

  function withPainter(context) {
    return () => {
      const m = rotation(), half = Math.min(canvas.width, canvas.height) / 2, size = scale() * half;
      const seen = [];
      for (const sign of sides()) {
        const place = new Float32Array(3 * count);
        for (let i = 0; i < 3 * count; i += 3) {
          const p = [position[i], position[i + 1], position[i + 2]];
          if (data.mirror !== null) p[data.mirror] *= sign;
          for (let k = 0; k < 3; k++)
            place[i + k] = m[3 * k] * p[0] + m[3 * k + 1] * p[1] + m[3 * k + 2] * p[2];
        }
        for (let t = 0; t < shown(); t += 3) {
          const [a, b, c] = [triangles[t], triangles[t + 1], triangles[t + 2]];
          seen.push([place[3 * a + 2] + place[3 * b + 2] + place[3 * c + 2], place, a, b, c]);
        }
      }
      seen.sort((one, other) => one[0] - other[0]);
      context.clearRect(0, 0, canvas.width, canvas.height);
      const across = (p) => canvas.width / 2 + p * size + view.x * half;
      const down = (p) => canvas.height / 2 - p * size - view.y * half;
      for (const [, place, a, b, c] of seen) {
        const [ax, ay, az] = place.subarray(3 * a, 3 * a + 3);
        const ux = place[3 * b] - ax, uy = place[3 * b + 1] - ay, uz = place[3 * b + 2] - az;
        const vx = place[3 * c] - ax, vy = place[3 * c + 1] - ay, vz = place[3 * c + 2] - az;
        const nz = ux * vy - uy * vx;
        const length = Math.hypot(uy * vz - uz * vy, uz * vx - ux * vz, nz) || 1;
        const light = data.ambient + (1 - data.ambient) * Math.abs(nz / length);
        const entry = 3 * Math.round((255 * (value[a] + value[b] + value[c])) / 3);
        const rgb = [0, 1, 2].map((k) => Math.round(colours[entry + k] * light));
        context.fillStyle = context.strokeStyle = `rgb(${rgb})`;
        context.beginPath();
        context.moveTo(across(ax), down(ay));
        context.lineTo(across(ax + ux), down(ay + uy));
        context.lineTo(across(ax + vx), down(ay + vy));
        context.closePath();
        context.fill();
        context.stroke();
      }
    };
  }

  const forced = new URLSearchParams(location.search).get("painter") !== null;
  const gl = forced ? null : canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
  const draw = (gl && withGl(gl)) || withPainter(canvas.getContext("2d"));

  let waiting = false, changed = true;
  function redraw(posed) {
    changed = changed || posed;
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      if (changed) pose();
      draw(changed);
      changed = false;
    });
  }

  const slider = find("pressure"), quantity = find("quantity");
  function say() {
    const shownQuantity = data.quantities[state.quantity];
    const first = Math.floor(state.step), between = state.step - first;
    const next = Math.min(first + 1, steps.length - 1);
    const kpa = steps[first].kpa + between * (steps[next].kpa - steps[first].kpa);
    const name = shownQuantity.name[0].toUpperCase() + shownQuantity.name.slice(1);
    const what = between
      ? `drawn between the calculated ${steps[first].kpa} and ${steps[next].kpa} kPa`
      : steps[first].peaks[state.quantity];
    find("said").textContent = `${name} at ${+kpa.toFixed(2)} kPa: ${what}.`;
    find("low").textContent = `${shownQuantity.low}`;
    find("high").textContent = `${shownQuantity.high} ${shownQuantity.unit} and above`.replace("  ", " ");
    slider.setAttribute("aria-valuetext", `${+kpa.toFixed(2)} kPa`);
  }
  function goTo(step) {
    const near = Math.round(step);
    // steps are magnetic: what was calculated is easy to stop at
    state.step = Math.min(Math.max(Math.abs(step - near) < 0.12 ? near : step, 0), steps.length - 1);
    slider.value = state.step;
    say();
    redraw(true);
  }

  for (const [i, { name }] of data.quantities.entries()) quantity.add(new Option(name, i));
  quantity.addEventListener("change", () => {
    state.quantity = Number(quantity.value);
    say();
    redraw(true);
  });
  slider.addEventListener("input", () => goTo(Number(slider.value)));
  const cut = find("cut");
  cut.closest("label").hidden = data.mirror === null;
  cut.addEventListener("change", () => {
    state.cut = cut.checked;
    redraw(false);
  });
  find("reset").addEventListener("click", () => {
    reset();
    redraw(false);
  });

  const touches = new Map();
  const spread = () => {
    const [a, b] = [...touches.values()];
    return Math.hypot(a.x - b.x, a.y - b.y);
  };
  const zoom = (factor) => {
    view.zoom = Math.min(Math.max(view.zoom * factor, 0.3), 20);
    redraw(false);
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    touches.set(event.pointerId, { x: event.clientX, y: event.clientY });
  });
  canvas.addEventListener("pointermove", (event) => {
    const last = touches.get(event.pointerId);
    if (!last) return;
    const before = touches.size === 2 ? spread() : 0;
    const dx = event.clientX - last.x, dy = event.clientY - last.y;
    touches.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (touches.size === 2) return zoom(spread() / (before || 1));
    const size = Math.min(canvas.clientWidth, canvas.clientHeight);
    if (event.shiftKey) {
      view.x += (2 * dx) / size;
      view.y -= (2 * dy) / size;
    } else {
      view.yaw += dx * 0.01;
      view.pitch = Math.min(Math.max(view.pitch + dy * 0.01, -Math.PI / 2), Math.PI / 2);
    }
    redraw(false);
  });
  for (const name of ["pointerup", "pointercancel"])
    canvas.addEventListener(name, (event) => touches.delete(event.pointerId));
  canvas.addEventListener(
    "wheel",
    (event) => {
      // the page scrolls on unless somebody works in here
      if (document.activeElement !== canvas) return;
      event.preventDefault();
      zoom(Math.exp(-event.deltaY * 0.0015));
    },
    { passive: false }
  );
  const keys = {
    ArrowLeft: () => (view.yaw -= 0.1),
    ArrowRight: () => (view.yaw += 0.1),
    ArrowUp: () => (view.pitch = Math.max(view.pitch - 0.1, -Math.PI / 2)),
    ArrowDown: () => (view.pitch = Math.min(view.pitch + 0.1, Math.PI / 2)),
    "+": () => zoom(1.15),
    "=": () => zoom(1.15),
    "-": () => zoom(1 / 1.15),
    Home: reset,
    PageUp: () => goTo(Math.floor(state.step) + 1),
    PageDown: () => goTo(Math.ceil(state.step) - 1),
  };
  canvas.addEventListener("keydown", (event) => {
    const does = keys[event.key];
    if (!does || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    does();
    redraw(false);
  });

  find("still").hidden = true;
  canvas.hidden = find("controls").hidden = false;
  new ResizeObserver(() => {
    const ratio = window.devicePixelRatio || 1;
    canvas.width = Math.max(1, Math.round(canvas.clientWidth * ratio));
    canvas.height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    redraw(false);
  }).observe(canvas);
  say();
  redraw(true);
})();
