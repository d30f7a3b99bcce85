// SPDX-License-Identifier: Apache-2.0
// Option objects of Apache ECharts from the model of chart_model.h. ES5 without DOM: runs in the page, and in the engine
// that writes the figures to files. Runs after parts.js.
//
// gscFigures.kinds: [{id, title}]
// gscFigures.build(panel, kind, {dark, view, width, shown, title, subtitle}) -> {option, height}
//   view "min" | "pooled"; shown: rows that get a colour; title and subtitle may be left out
var gscFigures = (function () {
  'use strict';

  var parts = gscParts, words = parts.words;
  var axis = parts.axis, merged = parts.merged, rangeOf = parts.rangeOf, drawn = parts.drawn;
  var three = words.three, digits = words.digits, decibels = words.decibels, of255 = words.of255;
  var VIEW_NAMES = {min: 'worst frame', pooled: 'pooled'};
  var INSIDE = 'within 12° of the gaze';
  var MOST_BARS = 24; // rows of the figure of frame times
  var MOST_NAMED = 24; // most rows of a front with a legend entry each

  function scored(row) { return row.scored; }

  function partWords(part) { // accuracy inside or outside the fovea
    if (part === null) return 'no pixel';
    return 'PSNR worst, pooled ' + [part.min, part.pooled].map(decibels).join(', ') + ' dB' +
      (part.flip === null ? '' : ', FLIP ' + digits(part.flip, 3));
  }

  function rowTip(row) {
    var lines = [
      ['frame, median', three(row.ms.median) + ' ms' + (row.speedup === null ? '' : ', ' + digits(row.speedup, 3) + ' times')]
    ];
    if (row.repeats) lines.push(['of ' + row.repeats.count + ' repeats', three(row.repeats.min) + ' to ' + three(row.repeats.max) + ' ms']);
    lines.push(
      ['p95, p99, max', [row.ms.p95, row.ms.p99, row.ms.max].map(three).join(', ') + ' ms'],
      ['on the device, median', three(row.device_ms) + ' ms'],
      ['stage decode, median', three(row.decode_ms) + ' ms']
    );
    if (row.scored) lines.push(
      ['PSNR worst, p1, pooled', [row.min, row.p1, row.pooled].map(decibels).join(', ') + ' dB'],
      ['largest error', row.max_error < 1e9 ? digits(of255(row.max_error), 3) + '/255' : 'not finite'],
      ['temporal error, max', row.temporal_max === null ? '–' : three(of255(row.temporal_max)) + '/255']
    );
    if (row.ssim !== null) lines.push(['SSIM, mean', String(row.ssim)]);
    if (row.flip !== null) lines.push(['FLIP, mean', String(row.flip)]);
    if (row.fovea !== null) lines.push([INSIDE, partWords(row.fovea.inside)], ['around it', partWords(row.fovea.outside)]);
    lines.push(['decoded a frame', row.decoded === null ? '–' : words.grouped(row.decoded) + ' anchors']);
    lines.push(['hit rate', row.hit_rate === null ? '–' : (100 * row.hit_rate).toFixed(1) + ' %']);
    lines.push(['cache, peak memory', words.bytes(row.cache_bytes) + ', ' + words.bytes(row.peak_bytes)]);
    return '<b>' + words.escaped(row.name) + '</b><table style="font-size:12px;line-height:1.35">' + lines.map(function (line) {
      return '<tr><td style="padding:0 10px 0 0;text-align:left;opacity:.75">' + line[0] +
        '</td><td style="padding:0;text-align:left">' + line[1] + '</td></tr>';
    }).join('') + '</table>';
  }

  function accuracyFigure(panel, theme, options) {
    var rows = panel.rows, view = options.view, shown = options.shown, front = panel.views[view].front;
    var foveated = rows.filter(function (row) { return row.fovea !== null && row.fovea.inside !== null; });
    function inside(row) { return row.fovea.inside[view]; }
    var scale = parts.decibelScale(rows.filter(scored).map(function (row) { return row[view]; }).concat(foveated.map(inside)), 6);
    var peak = rangeOf(rows.map(function (row) { return row.peak_bytes; }))[1];
    var unit = peak >= Math.pow(1024, 3) ? ['GiB', Math.pow(1024, 3)] : ['MiB', Math.pow(1024, 2)];
    function memory(row) { return row.peak_bytes / unit[1]; }
    function time(row) { return row.ms.median; }
    var every = rows.map(function (row, index) { return index; }), spread = [];
    var repeated = every.filter(function (row) { return rows[row].repeats !== null && rows[row].scored; });
    repeated.forEach(function (row) { spread.push(rows[row].repeats.min, rows[row].repeats.max); });
    var head = parts.base(theme, options), option = head.option, width = options.width, gap = 70;
    var beside = width >= 640, plot_width = beside ? Math.floor((width - 66 - 44 - 30) / 2) : width - 66 - 30;
    var most = Math.max(3, Math.floor(plot_width / 70));
    var costs = [
      {name: 'frame time, median, ms', of: time, scale: parts.valueScale(rows.map(time).concat(spread), most)},
      {name: 'peak memory, ' + unit[0], of: memory, scale: parts.valueScale(rows.map(memory), most)}
    ];
    var qualities = [{
      name: 'PSNR, ' + VIEW_NAMES[view] + ', dB', height: 300, scale: scale, axis: parts.decibelAxis,
      of: function (row) { return row.scored ? drawn(scale, row[view]) : null; }
    }];
    var flips = rows.filter(function (row) { return row.flip !== null; }).map(function (row) { return row.flip; });
    if (flips.length) qualities.push({ // up is better here too
      name: 'FLIP, mean', height: 220, scale: parts.valueScale(flips, 5, true), of: function (row) { return row.flip; },
      axis: function (theme, scale, extra) { return parts.valueAxis(theme, merged(scale, {inverse: true}), extra); }
    });
    var plots = [], top = head.top + 18; // time and memory beside each other, or all below each other
    qualities.forEach(function (quality) {
      costs.forEach(function (cost, column) {
        plots.push({quality: quality, cost: cost, left: beside ? 66 + column * (plot_width + 44) : 66, top: top, own_labels: column === 0 || !beside});
        if (!beside || column === 1) top += quality.height + gap;
      });
    });

    option.grid = plots.map(function (plot) { return {left: plot.left, top: plot.top, width: plot_width, height: plot.quality.height}; });
    option.xAxis = plots.map(function (plot, index) {
      return parts.valueAxis(theme, plot.cost.scale, {
        gridIndex: index, position: 'bottom', axisLine: {onZero: false}, name: plot.cost.name, nameLocation: 'middle', nameGap: 30
      });
    });
    option.yAxis = plots.map(function (plot, index) {
      return plot.quality.axis(theme, plot.quality.scale, {
        gridIndex: index, name: plot.own_labels ? plot.quality.name : '', nameLocation: 'middle', nameGap: 46,
        axisLabel: {show: plot.own_labels}
      });
    });

    // Labels with the numbers of the front. Coloured runs too near to each other share a label; grey ones then have none.
    function labelsOf(plot) {
      var placed = [], labels = {};
      function place(row) {
        if (plot.quality.of(rows[row]) === null) return;
        var x = parts.shareOf(plot.cost.scale, plot.cost.of(rows[row])) * plot_width;
        var y = parts.shareOf(plot.quality.scale, plot.quality.of(rows[row])) * plot.quality.height;
        var number = String(front.indexOf(row) + 1), coloured = shown.indexOf(row) >= 0;
        var near = placed.filter(function (other) { return Math.abs(other.x - x) < 20 && Math.abs(other.y - y) < 13; })[0];
        if (!near) {
          placed.push({row: row, x: x, y: y});
          labels[row] = number;
        } else if (coloured) {
          labels[near.row] += ', ' + number;
        }
      }
      front.filter(function (row) { return shown.indexOf(row) >= 0; }).forEach(place);
      front.filter(function (row) { return shown.indexOf(row) < 0; }).forEach(place);
      return labels;
    }
    var labels = plots.map(labelsOf);
    function point(row, index) {
      return {
        value: [plots[index].cost.of(rows[row]), plots[index].quality.of(rows[row])], row: row, symbol: parts.symbolOf(rows[row]),
        label: {show: labels[index][row] !== undefined, formatter: labels[index][row] || ''}
      };
    }
    function scatter(name, list, index, color, size) {
      return {
        type: 'scatter', name: name, xAxisIndex: index, yAxisIndex: index, clip: false, symbolSize: size, z: size > 9 ? 4 : 3,
        itemStyle: {color: color, borderColor: theme.back, borderWidth: 1, opacity: 1}, cursor: 'pointer',
        // no other point lies above and to the left of the front; points of memory lie in columns
        label: merged(plots[index].cost === costs[0] ? {position: [-1, 1], align: 'right', verticalAlign: 'bottom'} : {position: 'right', distance: 4},
                      {color: theme.text, fontSize: 12, fontWeight: 'bold', textBorderColor: theme.back, textBorderWidth: 3}),
        data: list.filter(function (row) { return plots[index].quality.of(rows[row]) !== null; }).map(function (row) { return point(row, index); })
      };
    }
    function colorOf(row) { return shown.indexOf(row) < 0 ? theme.other : parts.colorOf(theme, rows[row]); }
    var named = shown.slice(); // rows with a legend entry each
    if (front.length <= MOST_NAMED) named = named.concat(front.filter(function (row) { return shown.indexOf(row) < 0; }));
    named.sort(function (a, b) { return time(rows[a]) - time(rows[b]) || a - b; });
    var others = every.filter(function (row) { return named.indexOf(row) < 0; });
    option.series = [{
      type: 'line', name: 'Pareto front', step: 'end', symbol: 'none', silent: true, z: 2, clip: false,
      lineStyle: {color: theme.dim, width: 1.5, type: 'dashed'}, itemStyle: {color: theme.dim},
      data: front.map(function (row) { return [time(rows[row]), drawn(scale, rows[row][view])]; })
    }];
    repeated.forEach(function (row) {
      var y = drawn(scale, rows[row][view]), repeats = rows[row].repeats;
      option.series.push({
        type: 'line', name: 'repeats, least to most', symbol: 'none', silent: true, z: 2, clip: false,
        lineStyle: {color: colorOf(row), width: 2}, data: [[repeats.min, y], [repeats.max, y]]
      });
    });
    if (foveated.length) option.series.push({ // beside the points of the whole pictures
      type: 'scatter', name: INSIDE, clip: false, symbolSize: 10, z: 3, itemStyle: {color: theme.back}, cursor: 'pointer',
      data: foveated.map(function (row) {
        var place = rows.indexOf(row);
        return {value: [time(row), drawn(scale, inside(row))], row: place, symbol: parts.symbolOf(row),
                itemStyle: {color: theme.back, borderColor: colorOf(place), borderWidth: 1.5, opacity: 1}};
      })
    });
    plots.forEach(function (plot, index) {
      if (others.length) option.series.push(scatter('other runs', others, index, theme.other, 7));
      named.forEach(function (row) {
        option.series.push(scatter(rows[row].name, [row], index, colorOf(row), shown.indexOf(row) < 0 ? 7 : 12));
      });
    });
    var entries = named.map(function (row) { return {name: rows[row].name, icon: parts.symbolOf(rows[row])}; });
    var box = 'path://M0 0H13H0ZM0 12H13H0Z'; // an empty path as high as the symbols
    if (others.length) entries.push({name: 'other runs', icon: 'circle'});
    if (foveated.length) entries.push({name: INSIDE, icon: 'diamond', itemStyle: {color: theme.back, borderColor: theme.dim, borderWidth: 1.5}});
    entries.push({name: 'Pareto front', icon: box + 'M0 5H5V7H0ZM8 5H13V7H8Z'});
    if (repeated.length) entries.push({name: 'repeats, least to most', icon: box + 'M0 5H13V7H0Z', itemStyle: {color: theme.dim}});
    var numbers = {};
    front.forEach(function (row, place) { numbers[rows[row].name] = place + 1 + '  ' + rows[row].name; });
    var legend_top = top - gap + 56;
    var key = parts.legend(theme, width, entries, legend_top, {
      itemWidth: 13, itemHeight: 11, formatter: function (name) { return numbers[name] || name; }
    });
    option.legend = key.option;
    option.tooltip = parts.tooltip(theme, {
      trigger: 'item',
      formatter: function (hit) { return hit.data && hit.data.row !== undefined ? rowTip(rows[hit.data.row]) : ''; }
    });
    return {option: option, height: legend_top + key.height};
  }

  function frameTimeFigure(panel, theme, options) {
    var rows = panel.rows, shown = options.shown, head = parts.base(theme, options), option = head.option;
    var list = rows.length <= MOST_BARS ? rows.map(function (row, index) { return index; }) : shown.slice();
    list.sort(function (a, b) { return rows[a].ms.median - rows[b].ms.median || a - b; });
    var widest = rangeOf(list.map(function (row) { return parts.textWidth(rows[row].name, 12); }))[1];
    var left = Math.ceil(Math.min(330, options.width * 0.36, widest + 24)), room = left - 16;
    var names = list.map(function (row) { return parts.wrapped(rows[row].name, 12, room, 3); });
    var most = rangeOf(names.map(function (lines) { return lines.length; }))[1], height = list.length * Math.max(32, most * 14 + 6) + 10;
    var key = parts.legend(theme, options.width, ['median', 'p95', 'p99', 'maximum'].map(function (name) { return {name: name}; }), head.top, {
      itemWidth: 12, selectedMode: false, itemStyle: {color: theme.dim}
    });
    option.legend = key.option;
    option.grid = {left: left, right: 30, top: head.top + key.height, height: height};
    option.yAxis = axis(theme, {
      type: 'category', inverse: true, data: names.map(function (lines) { return lines.join('\n'); }),
      axisTick: {show: false}, splitLine: {show: false},
      axisLabel: {color: theme.text, interval: 0, lineHeight: 14, hideOverlap: false}
    });
    var values = [];
    list.forEach(function (row) { values.push(rows[row].ms.median, rows[row].ms.max); });
    var scale = parts.valueScale(values, Math.max(3, Math.floor((options.width - left) / 70)), true);
    option.xAxis = parts.valueAxis(theme, scale, {name: 'frame time, ms (wall clock)', nameLocation: 'middle', nameGap: 30});
    function bar(from, to, width) { // one series: null values break the line between two runs
      var data = [];
      list.forEach(function (row, place) {
        data.push([rows[row].ms[from], place], [rows[row].ms[to], place], [null, null]);
      });
      return {type: 'line', silent: true, symbol: 'none', connectNulls: false, data: data, z: 2, tooltip: {show: false},
              lineStyle: {color: theme.other, width: width, cap: 'butt'}};
    }
    function marks(name, key, symbol, size, filled) {
      return {
        type: 'scatter', name: name, symbol: symbol, symbolSize: size, z: 4, itemStyle: {color: theme.dim},
        data: list.map(function (row, place) {
          var color = shown.indexOf(row) < 0 ? theme.other : parts.colorOf(theme, rows[row]);
          return {value: [rows[row].ms[key], place], row: row,
                  itemStyle: {color: filled ? color : theme.back, borderColor: color, borderWidth: 1.5, opacity: 1}};
        })
      };
    }
    option.series = [bar('median', 'max', 1.5), bar('median', 'p95', 7), marks('median', 'median', 'circle', 11, true),
                     marks('p95', 'p95', 'rect', [5, 15], true), marks('p99', 'p99', 'triangle', 10, true),
                     marks('maximum', 'max', 'diamond', 11, false)];
    option.tooltip = parts.tooltip(theme, {
      trigger: 'item',
      formatter: function (hit) { return hit.data && hit.data.row !== undefined ? rowTip(rows[hit.data.row]) : ''; }
    });
    return {option: option, height: head.top + key.height + height + 50};
  }

  function lastScored(row) { // -1: none. Scores are by camera, of which there may be more than frames
    var frames = row.frames, last = frames.psnr.length - 1;
    return last < 0 ? -1 : frames.listed.length ? frames.listed[last] : frames.first_scored + last * frames.every_scored;
  }

  function overTimeFigure(panel, theme, options) {
    var rows = panel.rows, shown = options.shown, head = parts.base(theme, options), option = head.option;
    var count = rangeOf(rows.map(function (row) { return Math.max(row.frames.wall.length, lastScored(row) + 1); }))[1], every = [];
    shown.forEach(function (row) { every = every.concat(rows[row].frames.psnr); });
    var scale = parts.decibelScale(every.length ? every : [null], 4);
    function plain(value) { return value; }
    var strips = [
      {key: 'psnr', name: 'PSNR of the worse eye, dB', draw: function (value) { return drawn(scale, value); }, text: decibels},
      {key: 'temporal', name: 'temporal error, 1/255', draw: of255, least: 0.1, text: function (value) { return three(of255(value)); }},
      {key: 'decoded', name: 'anchors decoded', draw: plain, text: function (value) { return digits(value, 4); }},
      {key: 'wall', name: 'frame time, ms', draw: plain, text: three}
    ];
    function isScore(kind) { return kind.key === 'psnr' || kind.key === 'temporal'; }
    function valueAt(row, kind, frame) { // undefined without a value
      var frames = rows[row].frames;
      if (!isScore(kind)) return frames[kind.key][frame];
      return frames[kind.key][frames.listed.length ? frames.listed.indexOf(frame) : (frame - frames.first_scored) / frames.every_scored];
    }
    function frameOf(row, kind, index) {
      var frames = rows[row].frames;
      if (!isScore(kind)) return index;
      return frames.listed.length ? frames.listed[index] : frames.first_scored + index * frames.every_scored;
    }
    var listed = shown.slice().sort(function (a, b) { return rows[a].hue - rows[b].hue || rows[a].shade - rows[b].shade || a - b; });
    var key = parts.legend(theme, options.width, listed.map(function (row) { return {name: rows[row].name}; }), head.top);
    option.legend = key.option;
    var strip = 108, gap = 46, top = head.top + key.height + 28;
    option.grid = [];
    option.xAxis = [];
    option.yAxis = [];
    option.series = [];
    strips.forEach(function (kind, index) {
      var last = index + 1 === strips.length;
      option.grid.push({left: 66, right: 34, top: top + index * (strip + gap), height: strip});
      option.xAxis.push(axis(theme, {
        type: 'value', gridIndex: index, min: 0, max: Math.max(count - 1, 1), minInterval: 1, axisLabel: {show: last},
        splitLine: {show: false}, name: last ? 'frame' : '', nameLocation: 'middle', nameGap: 28,
        axisPointer: {show: true, label: {show: false}, snap: true, lineStyle: {color: theme.dim}}
      }));
      var extra = {gridIndex: index, name: kind.name, nameLocation: 'end', nameGap: 15,
                   nameTextStyle: {align: 'left', padding: [0, 0, 0, -56], fontWeight: 'bold'}};
      if (kind.key === 'psnr') {
        option.yAxis.push(parts.decibelAxis(theme, scale, extra));
      } else {
        var values = [];
        shown.forEach(function (row) {
          rows[row].frames[kind.key].forEach(function (value) { if (value !== null) values.push(kind.draw(value)); });
        });
        option.yAxis.push(parts.valueAxis(theme, parts.valueScale(values, 3, true, kind.least), extra));
      }
      shown.forEach(function (row) {
        option.series.push({
          type: 'line', name: rows[row].name, xAxisIndex: index, yAxisIndex: index, showSymbol: rows[row].frames[kind.key].length <= 2, symbol: parts.symbolOf(rows[row]),
          symbolSize: 5, z: 3, clip: false, sampling: 'lttb', emphasis: {lineStyle: {width: 2.5}},
          lineStyle: {width: 1.6, color: parts.colorOf(theme, rows[row]), type: parts.dashOf(rows[row])},
          itemStyle: {color: parts.colorOf(theme, rows[row])},
          data: rows[row].frames[kind.key].map(function (value, index) {
            return [frameOf(row, kind, index), kind.draw(value)];
          })
        });
      });
    });
    option.axisPointer = {link: [{xAxisIndex: 'all'}]};
    option.tooltip = parts.tooltip(theme, {
      trigger: 'axis',
      formatter: function (hits) {
        if (!hits.length) return '';
        var frame = hits[0].value[0];
        return 'frame ' + frame + '<table style="font-size:12px;line-height:1.35"><tr>' +
          ['', 'dB', '1/255', 'decoded', 'ms'].map(function (name) {
            return '<td style="padding:0 0 0 10px;text-align:right;opacity:.75">' + name + '</td>';
          }).join('') + '</tr>' + shown.map(function (row) {
            return '<tr><td style="padding:0;text-align:left;white-space:nowrap"><span style="color:' + parts.colorOf(theme, rows[row]) + '">■</span> ' +
              words.escaped(rows[row].name) + '</td>' + strips.map(function (kind) {
                var value = valueAt(row, kind, frame);
                return '<td style="padding:0 0 0 10px;text-align:right">' + (value === undefined ? '–' : kind.text(value)) + '</td>';
              }).join('') + '</tr>';
          }).join('') + '</table>';
      }
    });
    return {option: option, height: top + strips.length * (strip + gap) + 6};
  }

  var KINDS = [
    {id: 'accuracy', title: 'Speed and memory against accuracy', draw: accuracyFigure},
    {id: 'frame-time', title: 'Frame time', draw: frameTimeFigure},
    {id: 'over-time', title: 'Over time', draw: overTimeFigure}
  ];

  return {
    kinds: KINDS.map(function (kind) { return {id: kind.id, title: kind.title}; }),
    mostBars: MOST_BARS,
    build: function (panel, id, options) {
      var kind = KINDS.filter(function (entry) { return entry.id === id; })[0];
      return kind.draw(panel, options.dark ? parts.dark : parts.light, options);
    }
  };
})();
