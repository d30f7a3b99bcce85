// SPDX-License-Identifier: Apache-2.0
// Option objects of Apache ECharts from the model of chart_model.h. ES5 without DOM: runs in the page, and in the engine
// that writes the figures to files.
//
// gscFigures.kinds: [{id, title}]
// gscFigures.build(panel, kind, {dark, view, width, shown, title, subtitle}) -> {option, height}
//   view "min" | "pooled"; shown: rows that get a colour; title and subtitle may be left out
var gscFigures = (function () {
  'use strict';

  // Okabe and Ito's colours, which people with any colour vision tell apart, lightened where the page is dark
  var LIGHT = {
    text: '#1f2328', dim: '#59636e', line: '#d1d9e0', grid: '#eaeef2', back: '#ffffff', other: '#b0b8c1',
    colors: ['#0072B2', '#D55E00', '#009E73', '#CC79A7', '#1f2328', '#56B4E9', '#E69F00', '#882255']
  };
  var DARK = {
    text: '#e6edf3', dim: '#9da7b3', line: '#3d444d', grid: '#21262d', back: '#0d1117', other: '#5b6570',
    colors: ['#56B4E9', '#E69F00', '#2cc295', '#e08fbf', '#e6edf3', '#8098ff', '#F0E442', '#b58656']
  };
  var DASHES = ['solid', 'dashed', 'dotted'];
  var SYMBOLS = {none: 'diamond', depth: 'rect', error: 'circle'}; // shape says the policy, colour the run
  var FONT = 'system-ui, Segoe UI, Roboto, Helvetica Neue, Arial, sans-serif'; // no quotes in it: ECharts writes it into attributes
  var VIEW_NAMES = {min: 'worst frame', pooled: 'pooled'};
  var MOST_BARS = 24; // rows of the figure of frame times
  var MOST_NAMED = 24; // of a front
  var BROKEN = -999; // decibels of an image with a pixel that is not finite

  function grouped(value) {
    return String(Math.round(value)).replace(/\B(?=(\d{3})+$)/g, ',');
  }
  function digits(value, count) { // 0.012345 -> 0.0123, 1234.5 -> 1,235
    if (value === null || value === undefined) return '–';
    if (Math.abs(value) >= Math.pow(10, count - 1)) return grouped(value);
    return value === 0 ? '0' : String(Number(value.toPrecision(count)));
  }
  function three(value) { // 2.4 -> 2.40: columns of equal digits
    if (value === null || value === undefined) return '–';
    if (value === 0) return '0';
    return value >= 100 ? grouped(value) : value >= 10 ? value.toFixed(1) : value >= 1 ? value.toFixed(2) : value.toFixed(3);
  }
  function decibels(value) {
    return value === null ? 'equal' : value <= BROKEN ? 'broken' : value.toFixed(1);
  }
  function of255(value) { // from 0..1 to steps of an 8-bit image
    return value === null ? null : value * 255;
  }
  function bytes(value) {
    var units = ['B', 'KiB', 'MiB', 'GiB', 'TiB'];
    var unit = 0;
    for (; value >= 1024 && unit + 1 < units.length; ++unit) value /= 1024;
    return digits(value, 3) + ' ' + units[unit];
  }
  function shortCount(value) { // for axes
    if (Math.abs(value) >= 1e6) return digits(value / 1e6, 3) + 'M';
    return Math.abs(value) >= 1e4 ? digits(value / 1e3, 3) + 'k' : digits(value, 4);
  }
  function escaped(text) {
    return String(text).replace(/&/g, '&amp;').replace(/</g, '&lt;').replace(/>/g, '&gt;').replace(/"/g, '&quot;');
  }

  function colorOf(theme, shown, row) {
    var place = shown.indexOf(row);
    return place < 0 ? theme.other : theme.colors[place % theme.colors.length];
  }
  function dashOf(shown, row) {
    return DASHES[Math.floor(Math.max(shown.indexOf(row), 0) / LIGHT.colors.length) % DASHES.length];
  }
  function symbolOf(row) {
    return SYMBOLS[row.policy] || 'triangle';
  }

  // Not Math.min.apply: an engine takes no more than some thousands of arguments.
  function rangeOf(values) {
    return values.reduce(function (range, value) {
      return [Math.min(range[0], value), Math.max(range[1], value)];
    }, [Infinity, -Infinity]);
  }

  // Round steps for decibels, and where equal images are drawn: one step above all others. Broken ones lie
  // one step below.
  function decibelScale(values, most) {
    var finite = values.filter(function (value) { return value !== null && value > BROKEN; });
    var equal = values.indexOf(null) >= 0, broken = values.some(function (value) { return value !== null && value <= BROKEN; });
    if (finite.length === 0) return {min: 0, max: 10, step: 10, cap: equal ? 10 : null, floor: broken ? 0 : null, bare: true};
    var range = rangeOf(finite), low = range[0], high = range[1];
    if (high - low < 1) {
      low -= 1;
      high += 1;
    }
    var steps = [0.5, 1, 2, 5, 10, 20, 50, 100, 1000], step = steps[0];
    for (var i = 0; i < steps.length; ++i) {
      step = steps[i];
      if ((high - low) / step <= most) break;
    }
    var min = Math.floor(low / step - 0.05) * step, max = Math.ceil(high / step + 0.05) * step;
    if (equal) max += step;
    if (broken) min -= step;
    min = Number(min.toFixed(3));
    max = Number(max.toFixed(3));
    return {min: min, max: max, step: step, cap: equal ? max : null, floor: broken ? min : null, bare: false};
  }
  function drawn(scale, value) {
    return value === null ? scale.cap : Math.max(value, scale.min);
  }
  function decibelAxis(theme, scale, extra) {
    return axis(theme, merged({
      type: 'value', min: scale.min, max: scale.max, interval: scale.step,
      axisLabel: {
        formatter: function (value) {
          if (scale.cap !== null && Math.abs(value - scale.cap) < 1e-6) return 'equal';
          if (scale.floor !== null && Math.abs(value - scale.floor) < 1e-6) return 'broken';
          return scale.bare ? '' : String(Number(value.toFixed(2)));
        }
      }
    }, extra));
  }

  function merged(base, extra) {
    var result = {}, key;
    for (key in base) result[key] = base[key];
    for (key in extra || {})
      result[key] = result[key] && typeof result[key] === 'object' && !Array.isArray(result[key]) ?
        merged(result[key], extra[key]) : extra[key];
    return result;
  }
  function axis(theme, extra) {
    return merged({
      axisLine: {show: true, lineStyle: {color: theme.line}}, axisTick: {lineStyle: {color: theme.line}},
      axisLabel: {color: theme.dim, fontSize: 12, hideOverlap: true}, splitLine: {lineStyle: {color: theme.grid}},
      nameTextStyle: {color: theme.text, fontSize: 12}
    }, extra);
  }
  // From zero where that costs little room; logarithmic where values span more than a factor of 30.
  function valueAxis(theme, values, extra) {
    var range = rangeOf(values), low = range[0], high = range[1];
    if (low > 0 && high / low > 30)
      return axis(theme, merged({type: 'log', min: Math.pow(10, Math.floor(Math.log(low) / Math.LN10 + 1e-9)),
                                 axisLabel: {formatter: shortCount}}, extra));
    return axis(theme, merged({type: 'value', scale: low > 0.2 * high && high > low, max: high > 0 ? undefined : 1,
                               boundaryGap: [0, '6%'], axisLabel: {formatter: shortCount}}, extra));
  }

  function tooltip(theme, extra) {
    return merged({
      confine: true, backgroundColor: theme.back, borderColor: theme.line,
      textStyle: {color: theme.text, fontSize: 12, fontFamily: FONT}
    }, extra);
  }
  // Entries flow from left to right; the height is estimated, a little too large.
  function legend(theme, width, entries, top, formatter) {
    var room = width - 20, icon = 22 + 5 + 12, lines = 1, used = 0;
    entries.forEach(function (entry) {
      var text = formatter ? formatter(entry.name) : entry.name, wide = Math.min(icon + text.length * 7, room);
      if (used > 0 && used + wide > room) {
        ++lines;
        used = 0;
      }
      used += wide;
    });
    return {
      height: lines * 22 + 8,
      option: {
        type: 'plain', data: entries, left: 10, right: 10, top: top, itemWidth: 22, itemHeight: 10, itemGap: 12, padding: 0,
        inactiveColor: theme.other, formatter: formatter, selectedMode: true,
        textStyle: {color: theme.text, fontSize: 12, width: room - 40, overflow: 'truncate', lineHeight: 14}
      }
    };
  }
  function base(theme, options) {
    var titles = [];
    if (options.title)
      titles.push({
        text: options.title, subtext: options.subtitle || '', left: 10, top: 8, itemGap: 4,
        textStyle: {color: theme.text, fontSize: 16, width: options.width - 20, overflow: 'truncate'},
        subtextStyle: {color: theme.dim, fontSize: 11, width: options.width - 20, overflow: 'break', lineHeight: 14}
      });
    return {
      option: {animation: false, backgroundColor: theme.back, textStyle: {fontFamily: FONT, color: theme.text}, title: titles},
      top: options.title ? 40 + Math.ceil((options.subtitle || '').length * 6 / (options.width - 20)) * 14 : 8
    };
  }

  function rowTip(row) {
    var lines = [
      ['frame, median', three(row.ms.median) + ' ms' + (row.speedup === null ? '' : ', ' + digits(row.speedup, 3) + ' times')],
      ['p95, p99, max', [row.ms.p95, row.ms.p99, row.ms.max].map(three).join(', ') + ' ms'],
      ['on the device, median', three(row.device_ms) + ' ms'],
      ['PSNR worst, p1, pooled', [row.min, row.p1, row.pooled].map(decibels).join(', ') + ' dB'],
      ['largest error', row.max_error < 1e9 ? digits(of255(row.max_error), 3) + '/255' : 'not finite'],
      ['temporal error, max', row.temporal_max === null ? '–' : three(of255(row.temporal_max)) + '/255']
    ];
    if (row.ssim !== null) lines.push(['SSIM, mean', String(row.ssim)]);
    if (row.flip !== null) lines.push(['FLIP, mean', String(row.flip)]);
    lines.push(['decoded a frame', row.decoded === null ? '–' : grouped(row.decoded)]);
    lines.push(['hit rate', row.hit_rate === null ? '–' : (100 * row.hit_rate).toFixed(1) + ' %']);
    lines.push(['cache, peak memory', bytes(row.cache_bytes) + ', ' + bytes(row.peak_bytes)]);
    return '<b>' + escaped(row.name) + '</b><table style="font-size:12px;line-height:1.35">' + lines.map(function (line) {
      return '<tr><td style="padding:0 10px 0 0;text-align:left;opacity:.75">' + line[0] +
        '</td><td style="padding:0;text-align:left">' + line[1] + '</td></tr>';
    }).join('') + '</table>';
  }

  function accuracyFigure(panel, theme, options) {
    var rows = panel.rows, view = options.view, shown = options.shown, front = panel.views[view].front;
    var scale = decibelScale(rows.map(function (row) { return row[view]; }), 6);
    var peak = rangeOf(rows.map(function (row) { return row.peak_bytes; }))[1];
    var unit = peak >= Math.pow(1024, 3) ? ['GiB', Math.pow(1024, 3)] : ['MiB', Math.pow(1024, 2)];
    function memory(row) { return row.peak_bytes / unit[1]; }
    function time(row) { return row.ms.median; }
    var head = base(theme, options), option = head.option, width = options.width, plot = 300;
    var beside = width >= 640, plot_width = beside ? Math.floor((width - 66 - 44 - 30) / 2) : width - 66 - 30;
    var top = head.top + 18, second_top = beside ? top : top + plot + 70;

    option.grid = [{left: 66, top: top, width: plot_width, height: plot},
                   {left: beside ? 66 + plot_width + 44 : 66, top: second_top, width: plot_width, height: plot}];
    option.xAxis = [
      valueAxis(theme, rows.map(time), {gridIndex: 0, name: 'frame time, median, ms', nameLocation: 'middle', nameGap: 30}),
      valueAxis(theme, rows.map(memory), {gridIndex: 1, name: 'peak memory, ' + unit[0], nameLocation: 'middle', nameGap: 30})
    ];
    option.yAxis = [0, 1].map(function (index) {
      var own_labels = index === 0 || !beside;
      return decibelAxis(theme, scale, {
        gridIndex: index, name: own_labels ? 'PSNR, ' + VIEW_NAMES[view] + ', dB' : '', nameLocation: 'middle', nameGap: 46,
        axisLabel: {show: own_labels}
      });
    });

    // Numbers of the front. Where two would lie on each other, coloured runs share a label and grey ones go without.
    function labelsOf(value) {
      var range = rangeOf(rows.map(value)), placed = [], labels = {};
      function place(row) {
        var x = (value(rows[row]) - range[0]) / (range[1] - range[0] || 1) * plot_width;
        var y = (drawn(scale, rows[row][view]) - scale.min) / (scale.max - scale.min) * plot;
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
    var values = [time, memory], labels = values.map(labelsOf);
    function point(row, index) {
      return {
        value: [values[index](rows[row]), drawn(scale, rows[row][view])], row: row, symbol: symbolOf(rows[row]),
        label: {show: labels[index][row] !== undefined, formatter: labels[index][row] || ''}
      };
    }
    function scatter(name, list, index, color, size) {
      return {
        type: 'scatter', name: name, xAxisIndex: index, yAxisIndex: index, clip: false, symbolSize: size, z: size > 9 ? 4 : 3,
        itemStyle: {color: color, borderColor: theme.back, borderWidth: 1, opacity: 1}, cursor: 'pointer',
        // above and to the left of the front there is no other point; memory comes in columns
        label: merged(index === 0 ? {position: [-1, 1], align: 'right', verticalAlign: 'bottom'} : {position: 'right', distance: 4},
                      {color: theme.text, fontSize: 12, fontWeight: 'bold', textBorderColor: theme.back, textBorderWidth: 3}),
        data: list.map(function (row) { return point(row, index); })
      };
    }
    var named = shown.slice(); // has an entry of its own in the legend
    if (front.length <= MOST_NAMED) named = named.concat(front.filter(function (row) { return shown.indexOf(row) < 0; }));
    named.sort(function (a, b) { return time(rows[a]) - time(rows[b]) || a - b; });
    var others = rows.map(function (row, index) { return index; }).filter(function (row) { return named.indexOf(row) < 0; });
    option.series = [{
      type: 'line', name: 'Pareto front', step: 'end', symbol: 'none', silent: true, z: 2, clip: false,
      lineStyle: {color: theme.dim, width: 1.5, type: 'dashed'}, itemStyle: {color: theme.dim},
      data: front.map(function (row) { return [time(rows[row]), drawn(scale, rows[row][view])]; })
    }];
    [0, 1].forEach(function (index) {
      if (others.length) option.series.push(scatter('other runs', others, index, theme.other, 7));
      named.forEach(function (row) {
        option.series.push(scatter(rows[row].name, [row], index, colorOf(theme, shown, row), shown.indexOf(row) < 0 ? 7 : 12));
      });
    });
    var entries = named.map(function (row) { return {name: rows[row].name, icon: symbolOf(rows[row])}; });
    if (others.length) entries.push({name: 'other runs', icon: 'circle'});
    entries.push({name: 'Pareto front', icon: 'path://M0 5H5V7H0ZM8 5H13V7H8Z'});
    var numbers = {};
    front.forEach(function (row, place) { numbers[rows[row].name] = place + 1 + '  ' + rows[row].name; });
    var legend_top = second_top + plot + 56;
    var key = legend(theme, width, entries, legend_top, function (name) { return numbers[name] || name; });
    option.legend = merged(key.option, {itemWidth: 13, itemHeight: 11});
    option.tooltip = tooltip(theme, {
      trigger: 'item',
      formatter: function (hit) { return hit.data && hit.data.row !== undefined ? rowTip(rows[hit.data.row]) : ''; }
    });
    return {option: option, height: legend_top + key.height};
  }

  function frameTimeFigure(panel, theme, options) {
    var rows = panel.rows, shown = options.shown, head = base(theme, options), option = head.option;
    var list = rows.length <= MOST_BARS ? rows.map(function (row, index) { return index; }) : shown.slice();
    list.sort(function (a, b) { return rows[a].ms.median - rows[b].ms.median || a - b; });
    var left = Math.min(330, Math.floor(options.width * 0.36)), height = list.length * 30 + 10;
    var longest = 2 * Math.floor((left - 16) / 7) - 4; // what two lines hold
    option.grid = {left: left, right: 30, top: head.top + 30, height: height};
    option.yAxis = axis(theme, {
      type: 'category', inverse: true, data: list.map(function (row) { return rows[row].name; }),
      axisTick: {show: false}, splitLine: {show: false},
      axisLabel: {
        color: theme.text, interval: 0, width: left - 16, overflow: 'break', lineHeight: 14, hideOverlap: false,
        formatter: function (name) { return name.length > longest ? name.slice(0, longest - 1) + '…' : name; }
      }
    });
    var values = [];
    list.forEach(function (row) { values.push(rows[row].ms.median, rows[row].ms.max); });
    option.xAxis = merged(valueAxis(theme, values, {name: 'frame time, ms (wall clock)', nameLocation: 'middle', nameGap: 30}),
                          {scale: false});
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
          var color = colorOf(theme, shown, row);
          return {value: [rows[row].ms[key], place], row: row,
                  itemStyle: {color: filled ? color : theme.back, borderColor: color, borderWidth: 1.5}};
        })
      };
    }
    option.series = [bar('median', 'max', 1.5), bar('median', 'p95', 7), marks('median', 'median', 'circle', 11, true),
                     marks('p95', 'p95', 'rect', [5, 15], true), marks('p99', 'p99', 'triangle', 10, true),
                     marks('maximum', 'max', 'diamond', 11, false)];
    option.legend = {
      data: ['median', 'p95', 'p99', 'maximum'], left: left, top: head.top, itemWidth: 12, itemHeight: 10, itemGap: 18,
      padding: 0, textStyle: {color: theme.text, fontSize: 12}, selectedMode: false, itemStyle: {color: theme.dim}
    };
    option.tooltip = tooltip(theme, {
      trigger: 'item',
      formatter: function (hit) { return hit.data && hit.data.row !== undefined ? rowTip(rows[hit.data.row]) : ''; }
    });
    return {option: option, height: head.top + 30 + height + 50};
  }

  function overTimeFigure(panel, theme, options) {
    var rows = panel.rows, shown = options.shown, head = base(theme, options), option = head.option;
    var count = rangeOf(rows.map(function (row) { return row.frames.wall.length; }))[1], every = [];
    shown.forEach(function (row) { every = every.concat(rows[row].frames.psnr); });
    var scale = decibelScale(every.length ? every : [null], 4);
    function plain(value) { return value; }
    var strips = [
      {key: 'psnr', name: 'PSNR of the worse eye, dB', draw: function (value) { return drawn(scale, value); }, text: decibels},
      {key: 'temporal', name: 'temporal error, 1/255', draw: of255, text: function (value) { return three(of255(value)); }},
      {key: 'decoded', name: 'anchors decoded', draw: plain, text: function (value) { return digits(value, 4); }},
      {key: 'wall', name: 'frame time, ms', draw: plain, text: three}
    ];
    var strip = 108, gap = 46, top = head.top + 28;
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
        option.yAxis.push(decibelAxis(theme, scale, extra));
      } else {
        option.yAxis.push(axis(theme, merged({type: 'value', min: 0, splitNumber: 3, axisLabel: {formatter: shortCount}}, extra)));
      }
      shown.forEach(function (row) {
        option.series.push({
          type: 'line', name: rows[row].name, xAxisIndex: index, yAxisIndex: index, showSymbol: count <= 2, symbol: 'circle',
          symbolSize: 5, z: 3, clip: false, sampling: 'lttb', emphasis: {lineStyle: {width: 2.5}},
          lineStyle: {width: 1.6, color: colorOf(theme, shown, row), type: dashOf(shown, row)},
          itemStyle: {color: colorOf(theme, shown, row)},
          data: rows[row].frames[kind.key].map(function (value, frame) { return [frame, kind.draw(value)]; })
        });
      });
    });
    option.axisPointer = {link: [{xAxisIndex: 'all'}]};
    var legend_top = top + strips.length * (strip + gap) + 12;
    var key = legend(theme, options.width, shown.map(function (row) { return {name: rows[row].name}; }), legend_top);
    option.legend = key.option;
    option.tooltip = tooltip(theme, {
      trigger: 'axis',
      formatter: function (hits) {
        if (!hits.length) return '';
        var frame = hits[0].value[0];
        return 'frame ' + frame + '<table style="font-size:12px;line-height:1.35"><tr>' +
          ['', 'dB', '1/255', 'decoded', 'ms'].map(function (name) {
            return '<td style="padding:0 0 0 10px;text-align:right;opacity:.75">' + name + '</td>';
          }).join('') + '</tr>' + shown.map(function (row) {
            return '<tr><td style="padding:0;text-align:left;white-space:nowrap"><span style="color:' + colorOf(theme, shown, row) + '">■</span> ' +
              escaped(rows[row].name) + '</td>' + strips.map(function (kind) {
                return '<td style="padding:0 0 0 10px;text-align:right">' + (frame < rows[row].frames.wall.length ? kind.text(rows[row].frames[kind.key][frame]) : '–') + '</td>';
              }).join('') + '</tr>';
          }).join('') + '</table>';
      }
    });
    return {option: option, height: legend_top + key.height};
  }

  var KINDS = [
    {id: 'accuracy', title: 'Speed and memory against accuracy', draw: accuracyFigure},
    {id: 'frame-time', title: 'Frame time', draw: frameTimeFigure},
    {id: 'over-time', title: 'Over time', draw: overTimeFigure}
  ];

  return {
    kinds: KINDS.map(function (kind) { return {id: kind.id, title: kind.title}; }),
    mostBars: MOST_BARS,
    words: {three: three, decibels: decibels, digits: digits, grouped: grouped, of255: of255, bytes: bytes},
    build: function (panel, id, options) {
      var kind = KINDS.filter(function (entry) { return entry.id === id; })[0];
      return kind.draw(panel, options.dark ? DARK : LIGHT, options);
    }
  };
})();
