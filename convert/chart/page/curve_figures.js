// SPDX-License-Identifier: Apache-2.0
// Option objects of Apache ECharts from the model of curve_model.h. ES5 without DOM: runs in the page, and in the engine
// that writes the figures to files. Runs after parts.js and has the interface of service_figures.js.
var gscFigures = (function () {
  'use strict';

  var parts = gscParts, words = parts.words, three = words.three;
  var LOOKS = [{hue: 2, shade: 0.3}, {hue: 1, shade: 0.5}, {hue: 3, shade: 0.5}, {hue: 4, shade: 0.4}, {hue: 0, shade: 0.4}];
  var SYMBOLS = ['circle', 'rect', 'triangle', 'diamond'];
  var SIDES = [ // cost of a point in each of the plots
    {key: 'per_anchor', name: 'archive, bytes an anchor'},
    {key: 'resident', name: 'resident, MiB', unit: 1048576},
    {key: 'frame', name: 'frame, ms'}
  ];
  var DETAILS = [0, 1, 2, 4]; // values of --detail for the numbers of point.detail

  function detailWords(point) { return point.detail.map(three).join(', '); }

  function costOf(point, side) { return point[side.key] / (side.unit || 1); }
  function nameOf(point) { return point.target === null ? 'the model itself' : 'target ' + words.digits(point.target, 4) + ' dB'; }

  function hint(curve, point) {
    var rows = [
      ['archive', words.bytes(point.archive) + ', ' + three(point.per_anchor) + ' bytes an anchor'], ['resident', words.bytes(point.resident)],
      ['frame, decode', three(point.frame) + ' ms, ' + three(point.decode) + ' ms'],
      ['detail ' + DETAILS.join(', '), detailWords(point) + ' ms'],
      ['together, worst', words.decibels(point.psnr) + ' dB, ' + words.decibels(point.worst_psnr) + ' dB'],
      ['SSIM, FLIP', words.digits(point.ssim, 4) + ', ' + words.digits(point.flip, 3)]
    ];
    return '<b>' + words.escaped(curve.name) + ', ' + nameOf(point) + '</b><table style="font-size:12px;line-height:1.35">' + rows.map(function (row) {
      return '<tr><td style="padding:0 10px 0 0;opacity:.75">' + row[0] + '</td><td style="padding:0">' + row[1] + '</td></tr>';
    }).join('') + '</table>';
  }

  function qualityFigure(panel, theme, options) {
    var head = parts.base(theme, options), option = head.option, curves = panel.curves;
    var solid = 'path://M0 0H22H0ZM0 12H22H0ZM0 5H22V7H0Z', dashes = 'path://M0 0H22H0ZM0 12H22H0ZM0 5H6V7H0ZM8 5H14V7H8ZM16 5H22V7H16Z';
    var entries = curves.map(function (curve, index) { return {name: curve.name, icon: SYMBOLS[index % SYMBOLS.length]}; }).concat([
      {name: 'all poses together', icon: solid, itemStyle: {color: theme.dim}}, {name: 'worst pose', icon: dashes, itemStyle: {color: theme.dim}}]);
    var key = parts.legend(theme, options.width, entries, head.top, {selectedMode: false});
    var beside = options.width >= 640, count = SIDES.length, left = 62, gap = 26, right = 20, plot = 290;
    var top = head.top + key.height + 14, each = beside ? (options.width - left - right - gap * (count - 1)) / count : options.width - left - right;
    var values = [];
    curves.forEach(function (curve) { curve.points.forEach(function (point) { values.push(point.psnr, point.worst_psnr); }); });
    var scale = parts.decibelScale(values, 8);
    option.legend = key.option;
    option.grid = SIDES.map(function (side, index) {
      return beside ? {left: left + index * (each + gap), top: top, width: each, height: plot} : {left: left, top: top + index * (plot + 66), width: each, height: plot};
    });
    option.xAxis = SIDES.map(function (side, index) {
      var costs = [];
      curves.forEach(function (curve) { curve.points.forEach(function (point) { costs.push(costOf(point, side)); }); });
      return parts.valueAxis(theme, parts.valueScale(costs, Math.max(3, Math.floor(each / 70)), true), {
        gridIndex: index, name: side.name, nameLocation: 'middle', nameGap: 30
      });
    });
    option.yAxis = SIDES.map(function (side, index) {
      var first = index === 0 || !beside;
      return parts.decibelAxis(theme, scale, {gridIndex: index, name: first ? 'PSNR, dB' : '', nameLocation: 'middle', nameGap: 42, axisLabel: {show: first}});
    });
    option.series = [];
    SIDES.forEach(function (side, index) {
      curves.forEach(function (curve, number) {
        var color = parts.colorOf(theme, LOOKS[number % LOOKS.length]);
        ['psnr', 'worst_psnr'].forEach(function (quality) {
          var worst = quality === 'worst_psnr';
          option.series.push({
            type: 'line', name: curve.name, xAxisIndex: index, yAxisIndex: index, symbol: SYMBOLS[number % SYMBOLS.length], symbolSize: worst ? 5 : 8, z: worst ? 3 : 4,
            showAllSymbol: true, clip: false, lineStyle: {color: color, width: worst ? 1.2 : 2, type: worst ? 'dashed' : 'solid'}, itemStyle: {color: color},
            data: curve.points.map(function (point) { return {value: [costOf(point, side), parts.drawn(scale, point[quality])], curve: curve, point: point}; })
          });
        });
      });
    });
    // series without data, for their legend entries
    option.series.push({type: 'line', name: 'all poses together', data: [], itemStyle: {color: theme.dim}}, {type: 'line', name: 'worst pose', data: [], itemStyle: {color: theme.dim}});
    option.tooltip = parts.tooltip(theme, {
      trigger: 'item', formatter: function (hit) { return hit.data && hit.data.point ? hint(hit.data.curve, hit.data.point) : ''; }
    });
    return {option: option, height: top + (beside ? plot : count * plot + (count - 1) * 66) + 58};
  }

  var COLUMNS = [
    ['Model', function (row) { return row.name; }, true],
    ['Target, dB', function (row) { return row.point.target === null ? 'itself' : words.digits(row.point.target, 4); }],
    ['Anchors', function (row) { return words.grouped(row.point.anchors); }],
    ['Archive', function (row) { return words.bytes(row.point.archive); }],
    ['An anchor, B', function (row) { return three(row.point.per_anchor); }],
    ['File', function (row) { return words.bytes(row.point.file); }],
    ['Resident', function (row) { return words.bytes(row.point.resident); }],
    ['Frame, ms', function (row) { return three(row.point.frame); }],
    ['Decode, ms', function (row) { return three(row.point.decode); }],
    ['Detail ' + DETAILS.join(', ') + ', ms', function (row) { return detailWords(row.point); }],
    ['Together, dB', function (row) { return words.decibels(row.point.psnr); }],
    ['Worst, dB', function (row) { return words.decibels(row.point.worst_psnr); }],
    ['SSIM', function (row) { return words.digits(row.point.ssim, 4); }],
    ['Worst', function (row) { return words.digits(row.point.worst_ssim, 4); }],
    ['FLIP', function (row) { return words.digits(row.point.flip, 3); }],
    ['Worst', function (row) { return words.digits(row.point.worst_flip, 3); }]
  ];

  return {
    kinds: [{id: 'quality', title: 'Quality against bytes, memory and time'}],
    tables: function (panel) {
      var rows = [];
      panel.curves.forEach(function (curve) {
        curve.points.forEach(function (point) { rows.push({name: curve.name, point: point}); });
      });
      return [{title: 'Points', rows: rows, columns: COLUMNS}];
    },
    build: function (panel, id, options) { return qualityFigure(panel, options.dark ? parts.dark : parts.light, options); }
  };
})();
