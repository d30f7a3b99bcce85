// SPDX-License-Identifier: Apache-2.0
// Parts that all figures use: numbers in words, colours, widths of text, axes, legends. ES5 without DOM, after ECharts.
var gscParts = (function () {
  'use strict';

  // Ramps of colours for the methods none, depth, error, detail and others; people with any colour vision tell them apart.
  var LIGHT = {
    text: '#1f2328', dim: '#59636e', line: '#d1d9e0', grid: '#eaeef2', back: '#ffffff', other: '#b0b8c1',
    ramps: [['#111418', '#57606a'], ['#8f3500', '#f7a04a'], ['#0a3f8f', '#55b8f7'], ['#00533c', '#35b98d'], ['#6b1f5c', '#d684b2']]
  };
  var DARK = {
    text: '#e6edf3', dim: '#9da7b3', line: '#3d444d', grid: '#21262d', back: '#0d1117', other: '#5b6570',
    ramps: [['#ffffff', '#a5b0bb'], ['#ffd7a8', '#d0570a'], ['#c8e6ff', '#2374cc'], ['#8ce8c6', '#1d9468'], ['#f2b3d6', '#a94f86']]
  };
  var DASHES = ['solid', 'dashed', 'dotted'];
  var SYMBOLS = {none: 'diamond', depth: 'rect', error: 'circle', detail: 'triangle'}; // by shape and hue: the method; by shade and dash: the run
  var FONT = 'system-ui, Segoe UI, Roboto, Helvetica Neue, Arial, sans-serif'; // no quotes in it: ECharts writes it into attributes
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
  function of255(value) { // a value of 0..1 in steps of an 8-bit image
    return value === null ? null : value * 255;
  }
  function bytes(value) {
    var units = ['B', 'KiB', 'MiB', 'GiB', 'TiB'];
    var unit = 0;
    for (; value >= 1024 && unit + 1 < units.length; ++unit) value /= 1024;
    return digits(value, 3) + ' ' + units[unit];
  }
  function shortCount(value) { // short form for axes: 12k, 3M
    if (Math.abs(value) >= 1e6) return digits(value / 1e6, 3) + 'M';
    return Math.abs(value) >= 1e4 ? digits(value / 1e3, 3) + 'k' : digits(value, 4);
  }
  function escaped(text) {
    return String(text).replace(/&/g, '&amp;').replace(/</g, '&lt;').replace(/>/g, '&gt;').replace(/"/g, '&quot;');
  }

  function mixed(from, to, share) { // '#rrggbb'
    var color = '#';
    for (var i = 1; i < 7; i += 2) {
      var a = parseInt(from.substr(i, 2), 16), b = parseInt(to.substr(i, 2), 16);
      color += ('0' + Math.round(a + (b - a) * share).toString(16)).slice(-2);
    }
    return color;
  }
  function colorOf(theme, row) {
    var ramp = theme.ramps[row.hue % theme.ramps.length];
    return mixed(ramp[0], ramp[1], row.shade);
  }
  function dashOf(row) {
    return DASHES[row.dash];
  }
  function symbolOf(row) {
    return SYMBOLS[row.method] || 'pin';
  }
  function textWidth(text, size) {
    return echarts.format.getTextRect(text, size + 'px ' + FONT).width;
  }
  function shortened(text, size, room) { // cut to fit `room` pixels
    if (textWidth(text, size) <= room) return text;
    while (text.length > 1 && textWidth(text + '…', size) > room) text = text.slice(0, -1);
    return text + '…';
  }
  function wrapped(text, size, room, most) { // lines of whole words, the last one shortened
    var lines = [];
    text.split(' ').forEach(function (word) {
      var last = lines.length - 1;
      if (last >= 0 && (last + 1 >= most || textWidth(lines[last] + ' ' + word, size) <= room)) lines[last] += ' ' + word;
      else lines.push(word);
    });
    return lines.map(function (line) { return shortened(line, size, room); });
  }

  // Least and largest value. Not Math.min.apply: an engine takes no more than some thousands of arguments.
  function rangeOf(values) {
    return values.reduce(function (range, value) {
      return [Math.min(range[0], value), Math.max(range[1], value)];
    }, [Infinity, -Infinity]);
  }
  function whole(value) { // without the rounding errors of added steps
    return Number(value.toPrecision(12));
  }
  // The smallest step of 1, 2 or 5 times a power of ten such that at most `most` steps make `span`.
  function stepOf(span, most) {
    var power = Math.pow(10, Math.floor(Math.log(span / most) / Math.LN10 + 1e-9));
    return whole([1, 2, 5, 10].filter(function (factor) { return span / (factor * power) <= most + 1e-9; })[0] * power);
  }

  // Scale for decibels. A step is 6 dB (twice the error) or more. Equal images lie one step above all others, broken images
  // one step below.
  function decibelScale(values, most) {
    var finite = values.filter(function (value) { return value !== null && value > BROKEN; });
    var equal = values.indexOf(null) >= 0, broken = values.some(function (value) { return value !== null && value <= BROKEN; });
    if (finite.length === 0) return {min: 0, max: 10, step: 10, cap: equal ? 10 : null, floor: broken ? 0 : null, bare: true};
    var range = rangeOf(finite), spare = Math.max(0, 6 - (range[1] - range[0])) / 2;
    var low = range[0] - spare, high = range[1] + spare, step = stepOf(high - low, most);
    var min = Math.floor(low / step - 0.05) * step, max = Math.ceil(high / step + 0.05) * step;
    if (equal) max += step;
    if (broken) min -= step;
    return {min: whole(min), max: whole(max), step: step, cap: equal ? whole(max) : null, floor: broken ? whole(min) : null, bare: false};
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
  // Scale for values. It begins at zero if that leaves values half of the room; it is logarithmic if they span more than a
  // factor of 30; else it spans a quarter of the largest value or more, so that noise looks small. `least`: least top.
  function valueScale(values, most, from_zero, least) {
    var range = rangeOf(values.concat(least || [])), low = range[0], high = range[1] > 0 ? range[1] : 1;
    if (!from_zero && low > 0 && high / low > 30) {
      var decade = Math.floor(Math.log(low) / Math.LN10 + 1e-9);
      return {type: 'log', min: Math.pow(10, decade), max: Math.pow(10, Math.ceil(Math.log(high) / Math.LN10 - 1e-9))};
    }
    if (from_zero || !(low > 0.5 * high)) {
      low = 0;
    } else {
      var spare = Math.max(0.25 * high - (high - low), 0.05 * high) / 2;
      low -= spare;
      high += spare;
    }
    var step = stepOf(high - low, most);
    return {type: 'value', min: whole(Math.floor(low / step + 1e-9) * step), max: whole(Math.ceil(high / step - 1e-9) * step), interval: step};
  }
  function shareOf(scale, value) { // position on the axis, 0..1
    if (scale.type === 'log') return Math.log(value / scale.min) / Math.log(scale.max / scale.min);
    return (value - scale.min) / (scale.max - scale.min);
  }
  function valueAxis(theme, scale, extra) {
    return axis(theme, merged(merged(scale, {axisLabel: {formatter: shortCount}}), extra));
  }

  function tooltip(theme, extra) {
    return merged({
      confine: true, backgroundColor: theme.back, borderColor: theme.line,
      textStyle: {color: theme.text, fontSize: 12, fontFamily: FONT}
    }, extra);
  }
  // Legend in columns as wide as the longest entry. Each entry is a legend of ECharts of its own, because one legend would
  // place an entry by an estimated width of the entry before it.
  function legend(theme, width, entries, top, extra) {
    var room = width - 20, gap = 18, icon = 22 + 5, line = 20;
    var texts = entries.map(function (entry) { return extra && extra.formatter ? extra.formatter(entry.name) : entry.name; });
    var wide = Math.min(icon + 2 + Math.ceil(rangeOf(texts.map(function (text) { return textWidth(text, 12); }))[1]), room);
    var columns = Math.max(1, Math.floor((room + gap) / (wide + gap)));
    return {
      height: Math.ceil(entries.length / columns) * line + 8,
      option: entries.map(function (entry, place) {
        return merged({
          data: [entry], left: 10 + place % columns * (wide + gap), top: top + Math.floor(place / columns) * line,
          itemWidth: 22, itemHeight: 10, padding: 0, inactiveColor: theme.other,
          textStyle: {color: theme.text, fontSize: 12, width: wide - icon, overflow: 'truncate'}
        }, extra);
      })
    };
  }
  function base(theme, options) {
    var titles = [], room = options.width - 30, lines = [];
    if (options.title) {
      lines = wrapped(options.subtitle || '', 11, room, 6);
      titles.push({
        text: shortened(options.title, 18, room), subtext: lines.join('\n'), left: 10, top: 13, itemGap: 4, padding: 0,
        textStyle: {color: theme.text, fontSize: 16}, subtextStyle: {color: theme.dim, fontSize: 11, lineHeight: 14}
      });
    }
    return {
      option: {animation: false, backgroundColor: theme.back, textStyle: {fontFamily: FONT, color: theme.text}, title: titles},
      top: options.title ? 46 + lines.length * 14 : 8
    };
  }

  return {
    light: LIGHT, dark: DARK, font: FONT,
    words: {three: three, decibels: decibels, digits: digits, grouped: grouped, of255: of255, bytes: bytes, escaped: escaped},
    colorOf: colorOf, dashOf: dashOf, symbolOf: symbolOf, textWidth: textWidth, wrapped: wrapped, rangeOf: rangeOf, merged: merged,
    decibelScale: decibelScale, drawn: drawn, decibelAxis: decibelAxis, valueScale: valueScale, shareOf: shareOf, valueAxis: valueAxis,
    axis: axis, tooltip: tooltip, legend: legend, base: base
  };
})();
