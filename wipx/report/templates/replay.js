/* The robot, moving */

const frames = data.frames;
const times = frames.t;
const figure = document.getElementById("figure");
const slider = document.getElementById("time");
const play = document.getElementById("play");
const layers = ["recorded", "nominal"].map((kind) => {
  const group = document.createElementNS("http://www.w3.org/2000/svg", "g");
  group.setAttribute("class", kind);
  const part = (name) => group.appendChild(document.createElementNS("http://www.w3.org/2000/svg", name));
  const lines = frames.lines.map(() => part("line"));
  const circles = Array.from({ length: frames.joints }, () => part("circle"));
  circles.forEach((circle) => circle.setAttribute("r", kind === "recorded" ? 7 : 4));
  figure.appendChild(group);
  return { group, lines, circles, points: unpack(frames[kind]) };
});
figure.setAttribute("viewBox", `0 0 ${frames.width} ${frames.height}`);
figure.setAttribute("width", frames.width);
slider.max = times.length - 1;

function showFrame(index) {
  layers.forEach(({ group, lines, circles, points }) => {
    const at = (point) => {
      const place = 2 * (index * frames.points + point);
      return [points[place], points[place + 1]];
    };
    const known = Number.isFinite(at(1)[0]);
    group.style.visibility = known ? "visible" : "hidden";
    if (!known) return;
    frames.lines.forEach(([from, to], k) => {
      const [x1, y1] = at(from);
      const [x2, y2] = at(to);
      Object.entries({ x1, y1, x2, y2 }).forEach(([name, value]) => lines[k].setAttribute(name, value));
    });
    circles.forEach((circle, k) => {
      const [cx, cy] = at(k + 1);
      circle.setAttribute("cx", cx);
      circle.setAttribute("cy", cy);
    });
  });
  document.getElementById("clock").textContent = `${times[index].toFixed(2)} s`;
}

let playing = null; // where and when it began

function tick(now) {
  if (playing === null) return;
  const t = playing.t + (now - playing.now) / 1000;
  const index = times.findIndex((time) => time >= t);
  slider.value = index < 0 ? times.length - 1 : index;
  showFrame(Number(slider.value));
  if (index < 0) stop();
  else requestAnimationFrame(tick);
}

function stop() {
  playing = null;
  play.textContent = "Play";
}

play.addEventListener("click", () => {
  if (playing !== null) {
    stop();
    return;
  }
  const begin = Number(slider.value) === times.length - 1 ? 0 : Number(slider.value);
  playing = { t: times[begin], now: performance.now() };
  play.textContent = "Stop";
  requestAnimationFrame(tick);
});
slider.addEventListener("input", () => { stop(); showFrame(Number(slider.value)); });

/* One joint over time */

const joint = document.getElementById("joint");

function drawJoint() {
  const own = data.joints[joint.selectedIndex];
  const element = document.getElementById("joint-chart");
  const t = unpack(own.t);
  const lines = { recorded: unpack(own.recorded), nominal: unpack(own.nominal) };
  const [low, high] = extent(lines.recorded);
  const range = visibleRange(Object.values(lines), [low - 0.75 * (high - low), high + 0.75 * (high - low)]);
  const traces = Object.entries(lines).map(([kind, y]) => line(kind, t, y, "y", true));
  if (own.command) {
    traces.push({
      x: t, y: unpack(own.command), yaxis: "y2", name: withUnit("command", own.commandUnit), type: "scatter", mode: "lines",
      line: { color: colour("command"), width: 1.2, shape: "hv" }, hovertemplate: "%{y:.4~g}",
    });
  }
  Plotly.react(element, traces, layout(element, {
    height: 380, hovermode: "x unified",
    yaxis: axis({ domain: own.command ? [0.36, 1] : [0, 1], range, title: { text: withUnit(own.name, own.unit) } }),
    yaxis2: axis({ domain: [0, 0.28], title: { text: withUnit("command", own.commandUnit) } }),
    xaxis: axis({ title: { text: "time [s]", standoff: 6, font: { size: 13 } }, anchor: own.command ? "y2" : "y" }),
  }), { ...config, displayModeBar: !isNarrow() });
}

joint.addEventListener("change", drawJoint);
showFrame(0);
start(drawJoint);
