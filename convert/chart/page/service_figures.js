// SPDX-License-Identifier: Apache-2.0
// Option objects of Apache ECharts from the model of trace_model.h. ES5 without DOM: runs in the page, and in the engine
// that writes the figures to files. Runs after parts.js and has the interface of figures.js.
var gscFigures = (function () {
  'use strict';

  var parts = gscParts, words = parts.words, three = words.three, digits = words.digits;
  var RATE = {hue: 2, shade: 0.4}, WORKERS = {hue: 3, shade: 0.55}, SHOWN = {hue: 2, shade: 0.7};
  var ENDS = [ // ends of poses other than shown, in colours that stand out
    {key: 'late', symbol: 'rect', color: {hue: 1, shade: 0.8}},
    {key: 'expired', symbol: 'triangle', color: {hue: 4, shade: 0.6}},
    {key: 'failed', symbol: 'diamond', color: {hue: 1, shade: 0.05}}
  ];
  var EVENTS = {
    start: {name: 'start', symbol: 'triangle', color: {hue: 3, shade: 0.6}},
    stop: {name: 'stop', symbol: 'path://M0 0H10L5 9Z', color: {hue: 2, shade: 0.6}},
    retire: {name: 'retired after a fault', symbol: 'path://M0 0L3 0L5 3L7 0L10 0L6.5 5L10 10L7 10L5 7L3 10L0 10L3.5 5Z', color: {hue: 1, shade: 0.2}},
    'return': {name: 'back', symbol: 'circle', color: {hue: 0, shade: 0.6}}
  };
  var STAGES = [{hue: 3, shade: 0.1}, {hue: 2, shade: 0.15}, {hue: 2, shade: 0.85}, {hue: 3, shade: 0.95}, {hue: 4, shade: 0.75}, {hue: 1, shade: 0.75}];

  function table(rows) {
    return '<table style="font-size:12px;line-height:1.35">' + rows.map(function (row) {
      return '<tr><td style="padding:0 10px 0 0;text-align:left;opacity:.75">' + row[0] +
        '</td><td style="padding:0;text-align:left">' + row[1] + '</td></tr>';
    }).join('') + '</table>';
  }
  function second(list) { return list.map(function (entry) { return entry[1]; }); }
  function nameAbove(name) {
    return {name: name, nameLocation: 'end', nameGap: 15, nameTextStyle: {align: 'left', padding: [0, 0, 0, -56], fontWeight: 'bold'}};
  }

  // Marks at starts, stops and faults of workers, as high as `heightOf` an event.
  function eventSeries(panel, theme, grid, heightOf) {
    return Object.keys(EVENTS).map(function (kind) {
      var look = EVENTS[kind];
      var hits = panel.events.filter(function (event) { return event.kind === kind; });
      return {
        type: 'scatter', name: look.name, xAxisIndex: grid, yAxisIndex: grid, symbol: look.symbol, symbolSize: 9, z: 5, clip: false,
        itemStyle: {color: parts.colorOf(theme, look.color), borderColor: theme.back, borderWidth: 1, opacity: 1},
        data: hits.map(function (event) { return {value: [event.time, heightOf(event)], event: event}; })
      };
    }).filter(function (series) { return series.data.length > 0; });
  }

  // A bar for each worker while it draws. Its name has its number only where devices have one name.
  function laneSeries(panel, theme, grid) {
    var color = parts.colorOf(theme, WORKERS);
    return panel.workers.map(function (worker, lane) {
      var data = [];
      worker.spans.forEach(function (span) { data.push([span[0], lane], [span[1], lane], [span[1], null]); });
      return {
        type: 'line', name: 'worker ' + worker.index, xAxisIndex: grid, yAxisIndex: grid, showSymbol: false, symbol: 'none', z: 3, clip: false,
        lineStyle: {color: color, width: 7, opacity: 0.45, cap: 'butt'}, itemStyle: {color: color}, data: data
      };
    });
  }
  function laneAxis(panel, theme, grid) {
    var devices = panel.workers.map(function (worker) { return worker.device; });
    var alike = devices.some(function (device, index) { return devices.indexOf(device) !== index; });
    return parts.axis(theme, parts.merged(nameAbove('workers, while they draw'), {
      type: 'category', gridIndex: grid, inverse: true, nameLocation: 'start', axisTick: {show: false}, splitLine: {show: false},
      data: panel.workers.map(function (worker) { return (alike ? worker.index + ': ' : '') + (worker.device || 'no device'); })
    }));
  }

  function overTimeFigure(panel, theme, options) {
    var head = parts.base(theme, options), option = head.option, strips = [0, 1, 2];
    var whole = !panel.events_cut && panel.workers.length > 0; // else nothing tells when each worker drew
    var events = eventSeries(panel, theme, 1, function (event) { return whole ? event.worker : event.workers; });
    var ends = ENDS.filter(function (end) { return panel.poses[end.key].length > 0; });
    var limits = panel.min_fps !== null || panel.max_fps !== null;
    var plans = panel.events.filter(function (event) { return event.kind === 'plan'; });
    var entries = [{name: 'shown', icon: 'circle'}].concat(ends.map(function (end) { return {name: end.key, icon: end.symbol}; }),
      events.map(function (series) { return {name: series.name, icon: series.symbol}; }));
    var dashes = 'path://M0 0H13H0ZM0 12H13H0ZM0 5H5V7H0ZM8 5H13V7H8Z';
    if (limits) entries.push({name: 'limits of the rate', icon: dashes, itemStyle: {color: theme.dim}});
    if (plans.length) entries.push({name: 'another plan', icon: 'path://M0 0H13H0ZM0 12H13H0ZM5 0H7V5H5ZM5 7H7V12H5Z', itemStyle: {color: theme.dim}});
    var key = parts.legend(theme, options.width, entries, head.top, {itemWidth: 12, itemHeight: 11, selectedMode: false});
    var strip = 120, gap = 48, top = head.top + key.height + 28, end = panel.end > 0 ? panel.end : 1;
    var heights = [strip, whole ? Math.min(Math.max(24 * panel.workers.length, 48), 360) : strip, strip], tops = [top];
    tops.push(tops[0] + heights[0] + gap);
    tops.push(tops[1] + heights[1] + gap);
    var step = parts.valueScale([0, end], Math.max(4, Math.floor(options.width / 90)), true);
    option.legend = key.option;
    option.grid = strips.map(function (index) { return {left: 66, right: 34, top: tops[index], height: heights[index]}; });
    option.xAxis = strips.map(function (index) {
      var last = index === 2;
      return parts.valueAxis(theme, {type: 'value', min: 0, max: end, interval: step.interval}, {
        gridIndex: index, axisLabel: {show: last, showMaxLabel: false}, splitLine: {show: false}, name: last ? 'time, s' : '', nameLocation: 'middle', nameGap: 28
      });
    });
    var fps = second(panel.rate).concat([panel.min_fps, panel.max_fps].filter(function (limit) { return limit !== null; }));
    var most = parts.rangeOf(panel.rate.map(function (sample) { return sample[2]; }).concat(panel.workers.length, 1))[1];
    var ms = [];
    ['shown', 'late', 'failed'].forEach(function (end) { ms = ms.concat(second(panel.poses[end])); });
    if (!ms.length) ms = second(panel.poses.expired); // beside other poses these are drawn at the edge, because their wait means little
    var latency = parts.valueScale(ms.length ? ms.map(function (value) { return Math.max(value, 0.01); }) : [1], 4, false);
    option.yAxis = [
      parts.valueAxis(theme, parts.valueScale(fps.length ? fps : [1], 3, true), parts.merged(nameAbove('pictures a second'), {gridIndex: 0})),
      whole ? laneAxis(panel, theme, 1) : parts.axis(theme, parts.merged(nameAbove('workers that draw'), {type: 'value', gridIndex: 1, min: 0, max: most, minInterval: 1, splitNumber: 3})),
      parts.valueAxis(theme, latency, parts.merged(nameAbove('ms from submitted to the end'), {gridIndex: 2}))
    ];
    function steps(name, index, column, look, fill) {
      var color = parts.colorOf(theme, look), first = panel.rate.length ? [[0, panel.rate[0][column]]] : [];
      return {
        type: 'line', name: name, xAxisIndex: index, yAxisIndex: index, step: 'start', showSymbol: false, symbol: 'none', z: 3, clip: false,
        lineStyle: {color: color, width: 1.6}, itemStyle: {color: color}, areaStyle: fill ? {color: color, opacity: 0.18} : undefined,
        data: first.concat(panel.rate.map(function (sample) { return [sample[0], sample[column]]; }))
      };
    }
    var rate = steps('rate', 0, 1, RATE, false);
    rate.markLine = {
      symbol: 'none', silent: true, animation: false, lineStyle: {color: theme.dim, type: 'dashed', width: 1.2},
      label: {show: false},
      data: [panel.min_fps, panel.max_fps].filter(function (limit) { return limit !== null; }).map(function (limit) { return {yAxis: limit}; })
    };
    var workers = whole ? laneSeries(panel, theme, 1) : [steps('workers', 1, 2, WORKERS, true)];
    workers[0].markLine = {
      symbol: 'none', silent: true, animation: false, lineStyle: {color: theme.dim, type: 'dashed', width: 1}, label: {show: false},
      data: plans.map(function (event) { return {xAxis: event.time}; })
    };
    function points(name, list, look, symbol, size, z) {
      return {
        type: 'scatter', name: name, xAxisIndex: 2, yAxisIndex: 2, symbol: symbol, symbolSize: size, z: z, large: false,
        itemStyle: {color: parts.colorOf(theme, look), opacity: name === 'shown' ? 0.7 : 1},
        data: list.map(function (pose) { return {value: [pose[0], Math.min(Math.max(pose[1], latency.min), latency.max)], end: name, ms: pose[1]}; })
      };
    }
    option.series = [rate].concat(workers, events, [points('shown', panel.poses.shown, SHOWN, 'circle', 3, 3)], ends.map(function (end) {
      return points(end.key, panel.poses[end.key], end.color, end.symbol, 6, 4);
    }));
    // series without data, for their legend entries, because marks have none
    [limits ? 'limits of the rate' : '', plans.length ? 'another plan' : ''].forEach(function (name) {
      if (name) option.series.push({type: 'line', name: name, data: [], symbol: 'none', lineStyle: {color: theme.dim}, itemStyle: {color: theme.dim}});
    });
    option.tooltip = parts.tooltip(theme, {
      trigger: 'item',
      formatter: function (hit) {
        var event = hit.data && hit.data.event;
        if (event) {
          return '<b>' + words.escaped(EVENTS[event.kind].name) + '</b>' + table([
            ['time', digits(event.time, 4) + ' s'], ['worker', event.worker === null ? 'all' : String(event.worker)],
            ['why', words.escaped(event.cause)], ['pictures a second', three(event.rate)], ['workers that draw then', String(event.workers)]]);
        }
        if (hit.data && hit.data.end) return hit.data.end + table([['at', digits(hit.data.value[0], 5) + ' s'], ['after', three(hit.data.ms) + ' ms']]);
        return '';
      }
    });
    return {option: option, height: tops[2] + strip + 52};
  }

  function latencyFigure(panel, theme, options) {
    var head = parts.base(theme, options), option = head.option, spread = panel.distribution, plot = 300;
    if (spread === null) {
      option.title = (option.title || []).concat([{text: 'no pose was shown', left: 'center', top: head.top + 30, textStyle: {color: theme.dim, fontSize: 14, fontWeight: 'normal'}}]);
      return {option: option, height: head.top + 90};
    }
    var key = parts.legend(theme, options.width, [{name: 'poses', icon: 'rect'}, {name: 'share that took no longer', icon: 'path://M0 0H13H0ZM0 12H13H0ZM0 5H13V7H0Z'}], head.top,
                           {itemWidth: 13, itemHeight: 11, selectedMode: false});
    var top = head.top + key.height + 36, width = spread.step * Math.max(spread.counts.length, 1);
    option.legend = key.option;
    option.grid = {left: 66, right: 66, top: top, height: plot};
    var across = parts.valueScale([0, width], Math.max(4, Math.floor(options.width / 90)), true);
    option.xAxis = parts.valueAxis(theme, across, {name: 'latency, ms' + (spread.over ? '; ' + words.grouped(spread.over) + ' poses took longer' : ''),
                                                   nameLocation: 'middle', nameGap: 30, splitLine: {show: false}});
    var counts = parts.valueScale(spread.counts.concat(1), 5, true);
    option.yAxis = [
      parts.valueAxis(theme, counts, {name: 'poses', nameLocation: 'middle', nameGap: 46}),
      parts.axis(theme, {type: 'value', min: 0, max: 100, interval: 20, name: 'share, %', nameLocation: 'middle', nameGap: 40, splitLine: {show: false}})
    ];
    var edges = [], bars = parts.colorOf(theme, SHOWN), line = parts.colorOf(theme, {hue: 1, shade: 0.5});
    spread.counts.forEach(function (count, index) { edges.push([index * spread.step, count]); });
    edges.push([width, spread.counts.length ? spread.counts[spread.counts.length - 1] : 0], [width, 0]);
    var inside = spread.cdf.filter(function (point) { return point[0] <= width; });
    if (inside.length < spread.cdf.length && inside.length) inside.push([width, inside[inside.length - 1][1]]);
    // names above each other if they would touch side by side
    var marks = ['p50', 'p95', 'p99'].map(function (name) { return {name: name, ms: panel.latency[name]}; }).filter(function (mark) { return mark.ms <= width; });
    var per_ms = (options.width - 132) / across.max, level = 0, before = -1e9;
    option.series = [{
      type: 'line', name: 'poses', step: 'end', symbol: 'none', silent: true, z: 2, data: edges,
      lineStyle: {color: bars, width: 1}, itemStyle: {color: bars}, areaStyle: {color: bars, opacity: 0.45},
      markLine: {
        symbol: 'none', silent: true, animation: false, lineStyle: {color: theme.dim, type: 'dashed', width: 1},
        data: marks.map(function (mark) {
          var text = mark.name + ' ' + three(mark.ms), x = mark.ms * per_ms;
          level = x - before < parts.textWidth(text, 12) + 8 ? level + 1 : 0;
          before = x;
          return {xAxis: mark.ms, label: {show: true, position: 'end', distance: [0, 2 + level * 14], formatter: text, color: theme.text, fontSize: 12}};
        })
      }
    }, {
      type: 'line', name: 'share that took no longer', yAxisIndex: 1, step: 'end', symbol: 'none', z: 3, data: inside.length ? [[inside[0][0], 0]].concat(inside) : [],
      lineStyle: {color: line, width: 2}, itemStyle: {color: line}
    }];
    option.tooltip = parts.tooltip(theme, {
      trigger: 'axis', axisPointer: {type: 'line', lineStyle: {color: theme.dim}},
      formatter: function (hits) {
        if (!hits.length) return '';
        var ms = hits[0].axisValue, bucket = Math.min(Math.floor(ms / spread.step), spread.counts.length - 1), below = 0;
        spread.cdf.forEach(function (point) { if (point[0] <= ms) below = point[1]; });
        return table([[three(bucket * spread.step) + ' to ' + three((bucket + 1) * spread.step) + ' ms', words.grouped(spread.counts[bucket]) + ' poses'],
                      ['up to ' + three(ms) + ' ms', digits(below, 3) + ' %']]);
      }
    });
    return {option: option, height: top + plot + 56};
  }

  function stagesFigure(panel, theme, options) {
    var head = parts.base(theme, options), option = head.option, workers = panel.workers;
    var names = workers.map(function (worker) {
      var label = worker.index + ': ' + (worker.device || 'no device') + (worker.name ? ', ' + worker.name : '');
      return parts.wrapped(label, 12, Math.min(260, options.width * 0.3), 2);
    });
    var left = Math.ceil(parts.rangeOf(names.map(function (lines) {
      return parts.rangeOf(lines.map(function (line) { return parts.textWidth(line, 12); }))[1];
    }).concat(20))[1]) + 24;
    var series = panel.stages.map(function (name, index) {
      return {name: name, color: parts.colorOf(theme, STAGES[index % STAGES.length]), values: workers.map(function (worker) { return worker.stage_s[index]; })};
    });
    series.push({name: 'not told by stage', color: theme.other, values: workers.map(function (worker) { return worker.untold_s; })});
    var key = parts.legend(theme, options.width, series.map(function (one) { return {name: one.name, icon: 'rect'}; }), head.top, {itemWidth: 13, itemHeight: 11});
    var sums = workers.map(function (worker, index) { return series.reduce(function (sum, one) { return sum + one.values[index]; }, 0); });
    var notes = workers.map(function (worker) {
      return words.grouped(worker.parts) + ' part' + (worker.parts === 1 ? '' : 's') + (worker.parts ? ', ' + three(1000 * worker.busy_s / worker.parts) + ' ms each' : '');
    });
    var room = Math.ceil(parts.rangeOf(notes.map(function (note) { return parts.textWidth(note, 12); }).concat(10))[1]) + 16;
    var height = workers.length * 38 + 10, width = Math.max(options.width - left - 30, 100);
    option.legend = key.option;
    option.grid = {left: left, right: 30, top: head.top + key.height + 6, height: height};
    option.yAxis = parts.axis(theme, {
      type: 'category', inverse: true, data: names.map(function (lines) { return lines.join('\n'); }), axisTick: {show: false}, splitLine: {show: false},
      axisLabel: {color: theme.text, interval: 0, lineHeight: 14, hideOverlap: false}
    });
    // the longest bar leaves room for its note
    var scale = parts.valueScale(sums.concat(1e-3).map(function (sum) { return sum * width / Math.max(width - room, 60); }), Math.max(3, Math.floor(width / 80)), true);
    option.xAxis = parts.valueAxis(theme, scale, {name: 'time, s', nameLocation: 'middle', nameGap: 30});
    option.series = series.map(function (one) {
      return {type: 'bar', stack: 'time', name: one.name, barWidth: 22, itemStyle: {color: one.color}, emphasis: {disabled: true}, data: one.values};
    });
    option.series.push({
      type: 'scatter', name: 'notes', symbolSize: 0.01, silent: true, z: 5, tooltip: {show: false}, itemStyle: {color: theme.dim},
      label: {show: true, position: 'right', distance: 6, color: theme.dim, fontSize: 12, formatter: function (hit) { return notes[hit.dataIndex]; }},
      data: sums.map(function (sum, index) { return [sum, index]; })
    });
    option.tooltip = parts.tooltip(theme, {
      trigger: 'axis', axisPointer: {type: 'none'},
      formatter: function (hits) {
        if (!hits.length) return '';
        var worker = workers[hits[0].dataIndex];
        return '<b>' + words.escaped(names[hits[0].dataIndex].join(' ')) + '</b>' + table(series.map(function (one) {
          var value = one.values[hits[0].dataIndex];
          return [one.name, three(value) + ' s' + (worker.frames ? ', ' + three(1000 * value / worker.frames) + ' ms a frame' : '')];
        }));
      }
    });
    return {option: option, height: head.top + key.height + 6 + height + 50};
  }

  var EVENT_NAMES = {start: 'start', ready: 'ready', stop: 'stop', retire: 'retired', 'return': 'back', plan: 'plan'};
  var WORKER_COLUMNS = [
    ['Worker', function (worker) { return worker.index + ': ' + worker.device + (worker.name ? ', ' + worker.name : ''); }, true],
    ['At the end', function (worker) { return worker.state; }],
    ['Frames', function (worker) { return words.grouped(worker.frames); }],
    ['Parts', function (worker) { return words.grouped(worker.parts); }],
    ['ms a part', function (worker) { return worker.parts ? words.three(1000 * worker.busy_s / worker.parts) : '–'; }],
    ['Busy, %', function (worker) { return worker.busy_share === null ? '–' : (100 * worker.busy_share).toFixed(1); }],
    ['Load, ms', function (worker) { return words.three(worker.load_ms); }],
    ['Faults', function (worker) { return words.grouped(worker.faults); }],
    ['Last fault', function (worker) { return worker.last_fault; }, true]
  ];
  var EVENT_COLUMNS = [
    ['Time, s', function (event) { return words.three(event.time); }],
    ['Event', function (event) { return EVENT_NAMES[event.kind]; }],
    ['Worker', function (event) { return event.worker === null ? 'all' : String(event.worker); }],
    ['Workers then', function (event) { return String(event.workers); }],
    ['Pictures a second', function (event) { return words.three(event.rate); }],
    ['Why', function (event) { return event.cause; }, true]
  ];

  var KINDS = [
    {id: 'over-time', title: 'Rate, workers and latency over time', draw: overTimeFigure},
    {id: 'latency', title: 'Latency of poses shown', draw: latencyFigure},
    {id: 'stages', title: 'Time per worker and stage', draw: stagesFigure}
  ];

  return {
    kinds: KINDS.map(function (kind) { return {id: kind.id, title: kind.title}; }),
    tables: function (panel) {
      return [{title: 'Workers', rows: panel.workers, columns: WORKER_COLUMNS}, {title: 'Events', rows: panel.events, columns: EVENT_COLUMNS}];
    },
    build: function (panel, id, options) {
      var kind = KINDS.filter(function (entry) { return entry.id === id; })[0];
      return kind.draw(panel, options.dark ? parts.dark : parts.light, options);
    }
  };
})();
