// SPDX-License-Identifier: Apache-2.0
// Fills the page of service traces: facts, and per trace the figures of service_figures.js and the tables of workers and
// events.
(function () {
  'use strict';
  var model = JSON.parse(document.getElementById('model').textContent);
  var words = gscParts.words;
  var dark = window.matchMedia('(prefers-color-scheme: dark)');
  var figures = []; // {panel, kind, box, chart}
  var MOST_EVENTS = 30; // the rest comes at a click

  // Text only, so that no name in the data can become markup.
  function add(parent, tag, text, name) {
    var element = document.createElement(tag);
    if (text !== undefined && text !== null) element.textContent = text;
    if (name) element.className = name;
    parent.appendChild(element);
    return element;
  }

  function draw(figure) {
    var built = gscFigures.build(model.panels[figure.panel], figure.kind, {dark: dark.matches, width: figure.box.clientWidth});
    figure.box.style.height = built.height + 'px';
    if (figure.chart) figure.chart.resize();
    else figure.chart = echarts.init(figure.box, null, {renderer: 'canvas'});
    figure.chart.setOption(built.option, {replaceMerge: ['title', 'grid', 'xAxis', 'yAxis', 'series', 'legend']});
  }

  // columns: [[title, words of a row, left?], ...]
  function addTable(parent, rows, columns) {
    var table = add(add(parent, 'div', null, 'scroll'), 'table');
    var line = add(add(table, 'thead'), 'tr'), body = add(table, 'tbody');
    columns.forEach(function (column) { add(line, 'th', column[0], column[2] ? 'left' : ''); });
    return rows.map(function (row) {
      var tr = add(body, 'tr');
      columns.forEach(function (column) { add(tr, 'td', column[1](row), column[2] ? 'left' : ''); });
      return tr;
    });
  }

  var WORKERS = [
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
  var EVENTS = [
    ['Time, s', function (event) { return words.three(event.time); }],
    ['Event', function (event) { return gscFigures.eventNames[event.kind]; }],
    ['Worker', function (event) { return event.worker === null ? 'all' : String(event.worker); }],
    ['Workers then', function (event) { return String(event.workers); }],
    ['Pictures a second', function (event) { return words.three(event.rate); }],
    ['Why', function (event) { return event.cause; }, true]
  ];

  function addEvents(section, panel) {
    if (!panel.events.length) return;
    add(section, 'h3', 'Events');
    var hidden = addTable(section, panel.events, EVENTS).slice(MOST_EVENTS);
    if (!hidden.length) return;
    hidden.forEach(function (line) { line.hidden = true; });
    var button = add(section, 'button', hidden.length + ' more events');
    button.type = 'button';
    button.onclick = function () {
      hidden.forEach(function (line) { line.hidden = false; });
      button.remove();
    };
  }

  function drawAll() {
    figures.forEach(function (figure) { if (!figure.chart) draw(figure); });
  }

  model.facts.forEach(function (fact) {
    add(document.getElementById('facts'), 'dt', fact[0]);
    add(document.getElementById('facts'), 'dd', fact[1]);
  });
  document.getElementById('version').textContent = model.version;
  var watcher = 'IntersectionObserver' in window ? new IntersectionObserver(function (entries) {
    entries.forEach(function (entry) {
      if (!entry.isIntersecting) return;
      watcher.unobserve(entry.target);
      draw(figures.filter(function (figure) { return figure.box === entry.target; })[0]);
    });
  }, {rootMargin: '800px'}) : null;
  model.panels.forEach(function (panel, index) {
    var verdict = document.querySelector('#verdict dl');
    add(add(verdict, 'dt'), 'a', panel.title).href = '#panel-' + index;
    add(verdict, 'dd', panel.verdict);
    var section = add(document.getElementById('panels'), 'section');
    section.id = 'panel-' + index;
    add(add(section, 'div', null, 'heading'), 'h2', panel.title);
    add(section, 'p', panel.words, 'small');
    gscFigures.kinds.forEach(function (kind) {
      add(section, 'h3', kind.title);
      var box = add(section, 'div', null, 'figure');
      box.setAttribute('role', 'img');
      box.setAttribute('aria-label', kind.title + ', ' + panel.title + '; the tables below have the numbers');
      box.style.height = '440px';
      figures.push({panel: index, kind: kind.id, box: box, chart: null});
      if (watcher) watcher.observe(box);
    });
    add(section, 'h3', 'Workers');
    addTable(section, panel.workers, WORKERS);
    addEvents(section, panel);
  });
  if (!watcher) drawAll();
  function redraw() {
    figures.forEach(function (figure) { if (figure.chart) draw(figure); });
  }
  dark.addEventListener('change', redraw);
  window.addEventListener('beforeprint', drawAll);
  var waiting = 0;
  window.addEventListener('resize', function () {
    window.clearTimeout(waiting);
    waiting = window.setTimeout(redraw, 150);
  });
})();
