// SPDX-License-Identifier: Apache-2.0
// Fills a page of traces or of curves: facts, and per panel the figures and tables of service_figures.js or curve_figures.js.
(function () {
  'use strict';
  var model = JSON.parse(document.getElementById('model').textContent);
  var dark = window.matchMedia('(prefers-color-scheme: dark)');
  var figures = []; // {panel, kind, box, chart}
  var MOST_ROWS = 30; // rows before a click shows the rest

  // Adds an element with text only, so that no name in the data can become markup.
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

  function addRows(section, table) {
    if (!table.rows.length) return;
    add(section, 'h3', table.title);
    var hidden = addTable(section, table.rows, table.columns).slice(MOST_ROWS);
    if (!hidden.length) return;
    hidden.forEach(function (line) { line.hidden = true; });
    var button = add(section, 'button', hidden.length + ' more');
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
    gscFigures.tables(panel).forEach(function (table) { addRows(section, table); });
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
