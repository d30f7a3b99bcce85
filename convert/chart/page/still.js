// SPDX-License-Identifier: Apache-2.0
// Draws figures as SVG outside a browser, with the gscFigures of the page's script; called by chart_figures.cpp.

// functions of a browser that ECharts calls, without effect for pictures that stand still
var setTimeout = function () { return 0; }, clearTimeout = function () {};

// Widths of characters in DejaVu Sans, in hundredths of the font size. It is the widest of the fonts that the figures name
// or a system may use instead, so a text that fits in it fits in all.
var GSC_WIDTHS = {28: "ijl'", 32: ' .,;:', 35: 'ft|I()[]', 41: 'r-', 52: 'szc', 62: 'Faeghknopqu', 75: 'ABCDEKNOPRSUVXYZ', 82: 'w', 99: 'mWMG%@×–…'};
function gscMeasure(text, font) {
  var size = Number(/([0-9.]+)px/.exec(font)[1]), bold = /bold/.test(font) ? 1.13 : 1, sum = 0;
  for (var i = 0; i < text.length; ++i) {
    var wide = text.charCodeAt(i) < 128 ? 64 : 100;
    for (var key in GSC_WIDTHS)
      if (GSC_WIDTHS[key].indexOf(text.charAt(i)) >= 0) wide = Number(key);
    sum += wide;
  }
  return {width: sum / 100 * size * bold};
}

var gscModel = null;
function gscLoad(text) { echarts.setPlatformAPI({measureText: gscMeasure}); gscModel = JSON.parse(text); return String(gscModel.panels.length); }
function gscKinds() { return JSON.stringify(gscFigures.kinds); }
function gscDraw(text) {
  var wanted = JSON.parse(text), panel = gscModel.panels[wanted.panel];
  var built = gscFigures.build(panel, wanted.kind, {
    dark: false, view: 'min', width: 1000, shown: panel.views ? panel.views.min.shown : null,
    title: panel.title + ': ' + wanted.title.charAt(0).toLowerCase() + wanted.title.slice(1), subtitle: panel.words
  });
  var chart = echarts.init(null, null, {renderer: 'svg', ssr: true, width: 1000, height: built.height});
  chart.setOption(built.option);
  // librsvg and others do not know dominant-baseline
  var shift = {central: '0.35em', 'text-before-edge': '0.8em', 'text-after-edge': '-0.2em'};
  var svg = chart.renderToSVGString().replace(/dominant-baseline="([a-z-]+)"/g, function (all, kind) {
    return shift[kind] ? 'dy="' + shift[kind] + '"' : all;
  });
  chart.dispose();
  return svg;
}
