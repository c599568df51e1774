/* Where the mismatch is */

function heat(more) {
  return {
    type: "heatmap", zmin: 0, hoverongaps: false,
    colorscale: [[0, colour("heat-low")], [0.5, colour("heat-middle")], [1, colour("heat-high")]],
    ...more,
  };
}

const COLOUR_BAR = { thickness: 12, outlinewidth: 0, tickfont: { size: 11 }, len: 1, y: 0.5, nticks: 5 };

function drawMap() {
  const element = document.getElementById("map-chart");
  const [across, up] = data.map.signals;
  const units = data.map.units;
  Plotly.react(element, [heat({
    x: data.map.edges[0], y: data.map.edges[1], z: data.map.excess, zmax: data.map.top, colorbar: COLOUR_BAR,
    hovertemplate: `${plain(across)} %{x:.3~g} ${plain(units[0])}<br>${plain(up)} %{y:.3~g} ${plain(units[1])}`
      + "<br>excess %{z:.3~g} nats per row<extra></extra>",
  })], layout(element, {
    height: isPrinting() ? 280 : 380, margin: { l: 64, r: 12, t: 12, b: 48 },
    xaxis: axis({ title: { text: withUnit(across, units[0]), standoff: 6, font: { size: 13 } }, showgrid: false, zeroline: false }),
    yaxis: axis({ title: { text: withUnit(up, units[1]), font: { size: 13 } }, showgrid: false, zeroline: false }),
  }), { ...config, displayModeBar: false });
}

function drawStrips() {
  const element = document.getElementById("strip-chart");
  const { runs, edges, excess, top } = data.strips;
  const traces = runs.map((run, row) => heat({
    x: edges[row], y: [row - 0.42, row + 0.42], z: [excess[row]], zmax: top,
    showscale: row === 0, colorbar: COLOUR_BAR,
    hovertemplate: `${plain(run)}<br>t = %{x:.3~g} s<br>excess %{z:.3~g} nats per row<extra></extra>`,
  }));
  const names = runs.map((run) => plain(run.length > 28 ? `${run.slice(0, 26)}…` : run));
  Plotly.react(element, traces, layout(element, {
    height: Math.max(150, 64 + (isPrinting() ? 18 : 26) * runs.length), margin: { l: 64, r: 12, t: 8, b: 48 },
    xaxis: axis({ title: { text: "time [s]", standoff: 6, font: { size: 13 } }, showgrid: false, zeroline: false }),
    yaxis: axis({
      tickmode: "array", tickvals: runs.map((_, row) => row), ticktext: names, autorange: false, ticks: "",
      range: [runs.length - 0.5, -0.5], showgrid: false, zeroline: false,
    }),
  }), { ...config, displayModeBar: false });
}

/* Laws on the data */

function drawLaws() {
  const parent = document.getElementById("law-charts");
  while (parent.children.length < data.curves.length) parent.appendChild(document.createElement("div"));
  data.curves.forEach((curve, index) => {
    const element = parent.children[index];
    const shade = colour(curve.standIn ? "stand-in" : "completed");
    const unit = plain(curve.forceUnit);
    Plotly.react(element, [{
      x: curve.bins, y: curve.mean, type: "scatter", mode: "markers", name: "data",
      error_y: { type: "data", array: curve.spread, color: colour("floor"), thickness: 1.2, width: 3 },
      marker: { color: colour("floor"), size: 7 },
      hovertemplate: `%{y:.3~g} ± %{error_y.array:.2~g} ${unit}<extra>data</extra>`,
    }, {
      x: curve.at, y: curve.law, type: "scatter", mode: "lines", name: curve.standIn ? "stand-in" : "law",
      line: { color: shade, width: 2.5 }, hovertemplate: `%{y:.3~g} ${unit}<extra>law</extra>`,
    }], layout(element, {
      height: isPrinting() ? 260 : 340, margin: { l: 64, r: 12, t: 40, b: 84 },
      title: { text: plain(curve.title), x: 0, xanchor: "left", font: { size: 14 }, y: 0.98, yanchor: "top" },
      legend: { orientation: "h", x: 0, y: -0.22, yanchor: "top" },
      xaxis: axis({ title: { text: withUnit(curve.signal, curve.signalUnit), standoff: 6, font: { size: 13 } } }),
      yaxis: axis({ title: { text: withUnit(curve.force, curve.forceUnit), font: { size: 13 } }, range: curve.range }),
    }), { ...config, displayModeBar: false });
  });
}

/* What to record next */

function drawReference() {
  const element = document.getElementById("reference-chart");
  const { t, columns } = data.reference;
  const traces = columns.map(({ name, unit, values }) => ({
    x: t, y: values, type: "scatter", mode: "lines", name: withUnit(name, unit), line: { width: 1.8 },
    hovertemplate: `%{y:.3~g} ${plain(unit)}`,
  }));
  const one = columns.length === 1 ? withUnit(columns[0].name, columns[0].unit) : "reference";
  Plotly.react(element, traces, layout(element, {
    height: isPrinting() ? 180 : 240, margin: { l: 64, r: 12, t: 16, b: 48 }, showlegend: columns.length > 1,
    colorway: [colour("completed"), colour("nominal"), colour("command")], hovermode: "x unified",
    xaxis: axis({ title: { text: "time [s]", standoff: 6, font: { size: 13 } } }),
    yaxis: axis({ title: { text: one, font: { size: 13 } } }),
  }), { ...config, displayModeBar: false });
}

start(() => {
  if (data.map) {
    drawMap();
    drawStrips();
  }
  if (data.curves.length) drawLaws();
  if (data.reference) drawReference();
});
