/* Search */

function drawSearch() {
  const element = document.getElementById("search-chart");
  if (!data.search) {
    element.remove();
    return;
  }
  const { evaluations, seconds, bestLoss, logarithmic } = data.search;
  const one = bestLoss.filter((loss) => loss !== null).length < 2;
  Plotly.react(element, [{
    x: evaluations, y: bestLoss, customdata: seconds, type: "scatter", mode: one ? "markers" : "lines",
    line: { color: colour("completed"), width: 2, shape: "hv" }, marker: { size: 9 },
    hovertemplate: "best loss %{y:.5~g}<br>after %{x} evaluations, %{customdata:.3~g} s<extra></extra>",
  }], layout(element, {
    height: 260, margin: { l: 64, r: 12, t: 16, b: 44 }, showlegend: false,
    xaxis: axis({ title: { text: "evaluations", standoff: 6, font: { size: 13 } } }),
    yaxis: axis({ title: { text: "best loss", font: { size: 13 } }, type: logarithmic ? "log" : "linear" }),
  }), { ...config, displayModeBar: false });
}

start(drawSearch);
