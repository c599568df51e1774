"use strict";

const data = JSON.parse(document.getElementById("data").textContent);
const root = document.documentElement;
const config = {
  responsive: true,
  displaylogo: false,
  modeBarButtons: [["zoom2d", "pan2d", "resetScale2d", "toImage"]],
  toImageButtonOptions: { scale: 2 },
};

const colour = (name) => getComputedStyle(root).getPropertyValue(`--${name}`).trim();
const isNarrow = () => window.innerWidth < 600;
const isPrinting = () => root.dataset.theme === "light";

// Plotly reads a small HTML dialect in texts; names from recordings must not be taken for it.
const plain = (text) => text.replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/>/g, "&gt;");
const withUnit = (name, unit) => plain(unit ? `${name} [${unit}]` : name);

const bytesOf = (text) => Uint8Array.from(atob(text), (character) => character.charCodeAt(0)).buffer;
const unpack = (text) => new Float32Array(bytesOf(text));

function unround({ low, step, steps }) {
  const missing = 65535;
  return Float64Array.from(new Uint16Array(bytesOf(steps)), (n) => (n === missing ? NaN : low + n * step));
}

function axis(more) {
  return {
    gridcolor: colour("grid"), linecolor: colour("rule"), zerolinecolor: colour("rule"), zerolinewidth: 1,
    tickcolor: colour("rule"), automargin: true, ...more,
  };
}

function layout(element, more) {
  return {
    width: isPrinting() ? element.clientWidth : undefined, // paper does not resize
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
    font: { family: getComputedStyle(document.body).fontFamily, size: isPrinting() ? 11 : 13, color: colour("ink") },
    hoverlabel: { bgcolor: colour("card"), bordercolor: colour("rule"), font: { color: colour("ink") } },
    modebar: { bgcolor: "rgba(0,0,0,0)", color: colour("muted"), activecolor: colour("ink") },
    margin: { l: 56, r: 12, t: 44, b: 44 },
    legend: { orientation: "h", x: 0, xanchor: "left", y: 1, yanchor: "top", yref: "container" },
    ...more,
  };
}

/* Recorded and predicted */

const select = document.getElementById("recording");
const unpacked = new Map();

function recordingAt(index) {
  if (!unpacked.has(index)) {
    const { t, signals, commands } = data.traces[index];
    unpacked.set(index, {
      t: unpack(t),
      signals: signals.map((s) => ({
        ...s, recorded: unround(s.recorded), nominal: unround(s.nominal), completed: unround(s.completed),
      })),
      commands: commands.map((c) => ({ ...c, values: unround(c.values) })),
    });
  }
  return unpacked.get(index);
}

function extent(values) {
  let low = Infinity;
  let high = -Infinity;
  for (const value of values) {
    if (Number.isFinite(value)) {
      low = Math.min(low, value);
      high = Math.max(high, value);
    }
  }
  return [low, high];
}

// A nominal model may run away; it must not press what was recorded into a flat line.
function visibleRange(lines, reach) {
  const [low, high] = extent(lines.flatMap((line) => extent(line)));
  const clipped = [Math.max(low, reach[0]), Math.min(high, reach[1])];
  const margin = 0.06 * (clipped[1] - clipped[0]);
  return margin > 0 ? [clipped[0] - margin, clipped[1] + margin] : undefined;
}

const LINES = {
  recorded: { name: "recorded", width: 5, dash: "solid" }, // wide and pale: stays visible under a good prediction
  nominal: { name: "nominal model", width: 1.5, dash: "5px,3px" },
  completed: { name: "completed model", width: 1.5, dash: "solid" },
};

function line(kind, t, y, yaxis, first) {
  const { name, width, dash } = LINES[kind];
  return {
    x: t, y, yaxis, name, legendgroup: kind, showlegend: first, type: "scatter", mode: "lines", connectgaps: false,
    line: { color: colour(kind), width, dash }, hovertemplate: "%{y:.4~g}",
  };
}

function signalRow(signal, t) {
  const scaled = (values) => values.map((value) => value * signal.factor);
  const lines = { recorded: scaled(signal.recorded), nominal: scaled(signal.nominal), completed: scaled(signal.completed) };
  const [low, high] = extent(lines.recorded);
  const range = visibleRange(Object.values(lines), [low - 0.75 * (high - low), high + 0.75 * (high - low)]);
  return { title: withUnit(signal.name, signal.unit), lines, range, t };
}

function errorRow(signal, t) {
  const difference = (values) => values.map((value, row) => (value - signal.recorded[row]) * signal.errorFactor);
  const lines = { nominal: difference(signal.nominal), completed: difference(signal.completed) };
  const [low, high] = extent(signal.recorded);
  const reach = (high - low) * signal.errorFactor;
  const floor = signal.noiseFloor === null ? null : signal.noiseFloor * signal.errorFactor;
  const title = `${withUnit(signal.name, signal.errorUnit)}, predicted − recorded`;
  return { title, lines, range: visibleRange(Object.values(lines), [-reach, reach]), floor, t };
}

function drawTrace() {
  const index = select.selectedIndex;
  const { t, signals, commands } = recordingAt(index);
  const errors = document.querySelector("input[name=show]:checked").value === "errors";
  const rows = signals.map((signal) => (errors ? errorRow(signal, t) : signalRow(signal, t)));
  const weights = [...rows.map(() => 1), ...commands.map(() => 0.55)];
  const heights = (isPrinting() ? 140 : isNarrow() ? 170 : 210) * weights.reduce((sum, weight) => sum + weight, 0);
  const gap = 34 / heights;
  const total = weights.reduce((sum, weight) => sum + weight, 0);
  const traces = [];
  const shapes = [];
  const annotations = [];
  const axes = {};
  let top = 1;
  weights.forEach((weight, row) => {
    const bottom = row === weights.length - 1 ? 0 : top - weight / total;
    const name = row === 0 ? "y" : `y${row + 1}`;
    const own = rows[row];
    axes[row === 0 ? "yaxis" : `yaxis${row + 1}`] = axis({ domain: [bottom, top - gap], range: own?.range, nticks: 6 });
    if (own) {
      Object.entries(own.lines).forEach(([kind, y]) => traces.push(line(kind, t, y, name, row === 0)));
      if (own.floor) {
        shapes.push({
          type: "rect", layer: "below", xref: "x domain", x0: 0, x1: 1, yref: name, y0: -own.floor, y1: own.floor,
          fillcolor: colour("floor"), opacity: 0.28, line: { width: 0 },
        });
      }
    } else {
      const command = commands[row - rows.length];
      traces.push({
        x: t, y: command.values.map((value) => value * command.factor), yaxis: name, name: plain(command.name),
        showlegend: false, type: "scatter", mode: "lines", hovertemplate: "%{y:.4~g}",
        line: { color: colour("command"), width: 1.2, shape: "hv" },
      });
    }
    const command = commands[row - rows.length];
    const title = own ? own.title : `command ${withUnit(command.name, command.unit)}`;
    annotations.push({
      text: title, xref: "paper", x: 0, xanchor: "left", yref: "paper", y: top - gap, yanchor: "bottom",
      showarrow: false, font: { size: 13, color: colour("muted") },
    });
    top = bottom;
  });
  if (errors && rows.some((row) => row.floor)) {
    traces.push({
      x: [null], y: [null], name: "sensor-noise floor", type: "scatter", mode: "markers", hoverinfo: "skip",
      marker: { symbol: "square", size: 12, color: colour("floor"), opacity: 0.5 },
    });
  }
  const last = weights.length === 1 ? "y" : `y${weights.length}`;
  const element = document.getElementById("trace-chart");
  Plotly.react(element, traces, layout(element, {
    ...axes, annotations, shapes, height: heights + 44 + 34, hovermode: "x unified", hoversubplots: "axis",
    xaxis: axis({
      anchor: last, title: { text: "time [s]", standoff: 6, font: { size: 13 } }, range: [t[0], t[t.length - 1]],
      hoverformat: ".3f", unifiedhovertitle: { text: "t = %{x} s" },
    }),
    margin: { l: 56, r: 12, t: 34, b: 44 },
    uirevision: `${index}`,
  }), { ...config, displayModeBar: !isNarrow() });
  document.getElementById("trace-caption").textContent = data.traces[index].caption;
  document.getElementById("previous").disabled = index === 0;
  document.getElementById("next").disabled = index === data.traces.length - 1;
}

function step(by) {
  select.selectedIndex += by;
  drawTrace();
}

/* Prediction errors */

function drawErrors() {
  const parent = document.getElementById("error-charts");
  const bars = [["nominal", "nominal", "nominal"], ["completed", "completed", "completed"],
    ["noiseFloor", "floor", "noise floor"]];
  while (parent.children.length < data.errors.length) parent.appendChild(document.createElement("div"));
  data.errors.forEach((chart, index) => {
    const element = parent.children[index];
    const known = bars.flatMap(([key]) => chart[key]).filter((value) => value !== null && value > 0);
    const [low, high] = extent(known);
    const range = chart.logarithmic
      ? [Math.floor(Math.log10(low) - 0.3), Math.log10(high) + 0.12 * (Math.log10(high / low) + 0.6)]
      : [0, 1.15 * high];
    const traces = bars.map(([key, shade, name]) => ({
      type: "bar", x: chart.recordings, y: chart[key], name, marker: { color: colour(shade) }, cliponaxis: false,
      text: chart[`${key}Text`], textposition: "outside", textangle: 0, constraintext: "none",
      textfont: { size: isNarrow() || isPrinting() ? 11 : 13 },
      hovertemplate: `%{text} ${plain(chart.unit)}<extra>${name}</extra>`,
    }));
    const scale = chart.logarithmic ? "log" : "linear";
    Plotly.react(element, traces, layout(element, {
      barmode: "group", bargap: 0.25, bargroupgap: 0.06, height: isPrinting() ? 240 : 300,
      title: { text: withUnit(chart.signal, chart.unit), x: 0, xanchor: "left", font: { size: 14 }, y: 0.98, yanchor: "top" },
      margin: { l: 48, r: 8, t: 36, b: 64 },
      legend: { orientation: "h", x: 0, y: -0.14, yanchor: "top", itemwidth: 30 },
      yaxis: axis({ type: scale, range: known.length ? range : undefined, dtick: chart.logarithmic ? 1 : undefined }),
      xaxis: axis({ fixedrange: true, showgrid: false }),
    }), { ...config, displayModeBar: false });
  });
}

/* The whole page: drawn at once, and again when its colours or its width change. */

function start(draw) {
  if (select) {
    select.addEventListener("change", drawTrace);
    document.getElementById("previous").addEventListener("click", () => step(-1));
    document.getElementById("next").addEventListener("click", () => step(1));
    document.querySelectorAll("input[name=show]").forEach((input) => input.addEventListener("change", drawTrace));
  }
  const drawAll = () => {
    if (select) drawTrace();
    if (data.errors) drawErrors();
    draw();
  };
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", drawAll);
  window.matchMedia("(max-width: 599px)").addEventListener("change", drawAll);
  window.addEventListener("beforeprint", () => { root.dataset.theme = "light"; drawAll(); });
  window.addEventListener("afterprint", () => { delete root.dataset.theme; drawAll(); });
  drawAll();
}

