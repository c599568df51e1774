/* How often the answer is right */

function drawRates() {
  const parent = document.getElementById("rate-charts");
  while (parent.children.length < data.rates.length) parent.appendChild(document.createElement("div"));
  data.rates.forEach(({ title, rates }, index) => {
    const element = parent.children[index];
    Plotly.react(element, [{
      type: "scatter", mode: "markers", x: rates.map((one) => 100 * one.rate), y: rates.map((one) => plain(one.label)),
      error_x: {
        type: "data", symmetric: false, color: colour("completed"), thickness: 2, width: 0,
        array: rates.map((one) => 100 * (one.high - one.rate)), arrayminus: rates.map((one) => 100 * (one.rate - one.low)),
      },
      marker: { color: colour("completed"), size: 9 }, text: rates.map((one) => plain(one.text)),
      hovertemplate: "%{y}: %{text}<extra></extra>",
    }], layout(element, {
      height: 74 + 30 * rates.length, margin: { l: 64, r: 16, t: 32, b: 40 }, showlegend: false,
      title: { text: plain(title), x: 0, xanchor: "left", font: { size: 14 }, y: 0.98, yanchor: "top" },
      xaxis: axis({ range: [-2, 102], ticksuffix: " %", fixedrange: true, zeroline: false }),
      yaxis: axis({ autorange: "reversed", fixedrange: true, showgrid: false, ticks: "", type: "category" }),
    }), { ...config, displayModeBar: false });
  });
}

/* What was answered for what */

function drawConfusions() {
  const element = document.getElementById("confusion-chart");
  const { hidden, answered, counts, right } = data.confusions;
  const most = hidden.map((_, row) => Math.max(1, counts[row].reduce((sum, count) => sum + count, 0)));
  const annotations = [];
  const values = hidden.map((_, row) => answered.map((_, column) => {
    const count = counts[row][column];
    if (!count) return null;
    annotations.push({
      x: column, y: row, text: `${count}`, showarrow: false, font: { size: 11, color: colour("card") },
    });
    return (right[row][column] ? 1 : -1) * (0.35 + 0.65 * count / most[row]);
  }));
  const names = (texts) => texts.map((text) => plain(text.length > 34 ? `${text.slice(0, 32)}…` : text));
  Plotly.react(element, [{
    type: "heatmap", z: values, zmin: -1, zmax: 1, showscale: false, hoverongaps: false, xgap: 2, ygap: 2,
    colorscale: [[0, colour("nominal")], [0.5, colour("card")], [1, colour("completed")]],
    customdata: hidden.map((one, row) => answered.map((other, column) => [plain(one), plain(other), counts[row][column]])),
    hovertemplate: "%{customdata[0]}<br>answered %{customdata[1]}<br>%{customdata[2]} times<extra></extra>",
  }], layout(element, {
    height: 220 + 22 * hidden.length, margin: { l: 64, r: 12, t: 8, b: 64 }, annotations,
    xaxis: axis({
      tickmode: "array", tickvals: answered.map((_, column) => column), ticktext: names(answered), tickangle: -60,
      fixedrange: true, zeroline: false, ticks: "",
    }),
    yaxis: axis({
      tickmode: "array", tickvals: hidden.map((_, row) => row), ticktext: names(hidden), autorange: "reversed",
      fixedrange: true, zeroline: false, ticks: "",
    }),
  }), { ...config, displayModeBar: false });
}

start(() => {
  drawRates();
  drawConfusions();
});
