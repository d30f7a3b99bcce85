// SPDX-License-Identifier: Apache-2.0
// Fills the page: facts, the table, and for each panel the figures of figures.js, drawn when they come into view.
(function () {
  'use strict';
  var model = JSON.parse(document.getElementById('model').textContent);
  var words = gscParts.words;
  var dark = window.matchMedia('(prefers-color-scheme: dark)');
  var view = document.getElementById('view');
  var figures = []; // {panel, kind, box, chart, note}
  var picked = model.panels.map(function () { return null; }); // rows that a reader chose by clicking; null: the rows that the model shows

  // Adds an element with text only, so that no name in the data can become markup.
  function add(parent, tag, text, name) {
    var element = document.createElement(tag);
    if (text !== undefined && text !== null) element.textContent = text;
    if (name) element.className = name;
    parent.appendChild(element);
    return element;
  }

  function shownOf(index) {
    return picked[index] || model.panels[index].views[view.value].shown;
  }

  function percent(value) {
    return value === null ? '–' : (100 * value).toFixed(1);
  }

  function scored(row, value) {
    return row.scored ? words.decibels(value) : '–';
  }

  var COLUMNS = [
    ['Frame\ntime,\nms', function (row) { return words.three(row.ms.median); }],
    ['Speed-\nup', function (row) { return row.speedup === null ? '–' : row.speedup.toFixed(2) + '×'; }],
    ['Decode,\nms', function (row) { return words.three(row.decode_ms); }],
    ['Decoded\nanchors', function (row) { return row.decoded === null ? '–' : words.grouped(row.decoded); }],
    ['Hit\nrate,\n%', function (row) { return percent(row.hit_rate); }],
    ['PSNR\npooled,\ndB', function (row) { return scored(row, row.pooled); }],
    ['1st per-\ncentile,\ndB', function (row) { return scored(row, row.p1); }],
    ['worst\nframe,\ndB', function (row) { return scored(row, row.min); }],
    ['Temporal\nerror,\n1/255', function (row) { return words.three(words.of255(row.temporal_max)); }]
  ];
  function anyRow(holds) {
    return model.panels.some(function (panel) { return panel.rows.some(holds); });
  }
  function ofPart(part, key, words) { // value inside or outside the fovea
    return function (row) { return row.fovea && row.fovea[part] ? words(row.fovea[part][key]) : '–'; };
  }
  function flipWords(value) {
    return value === null ? '–' : value.toFixed(4);
  }
  if (anyRow(function (row) { return row.fovea !== null; })) {
    COLUMNS.push(['Pooled\nwithin\n12°, dB', ofPart('inside', 'pooled', words.decibels)], ['around\nit, dB', ofPart('outside', 'pooled', words.decibels)]);
    if (anyRow(function (row) { return row.fovea && row.fovea.inside && row.fovea.inside.flip !== null; }))
      COLUMNS.push(['FLIP\nwithin\n12°', ofPart('inside', 'flip', flipWords)], ['around\nit', ofPart('outside', 'flip', flipWords)]);
  }
  if (!anyRow(function (row) { return row.speedup !== null; }))
    COLUMNS.splice(1, 1); // no speed-up; the verdict tells the reason
  var MOST_ROWS = 8; // rows of a front before a click shows the rest

  function fillHead(head) {
    var line = add(head, 'tr');
    add(line, 'th', 'Run', 'left');
    COLUMNS.forEach(function (column) {
      var cell = add(line, 'th');
      column[0].split('\n').forEach(function (part, index) {
        if (index) add(cell, 'br');
        cell.appendChild(document.createTextNode(part));
      });
    });
  }

  function fillTable() {
    var body = document.querySelector('#summary tbody');
    body.textContent = '';
    model.panels.forEach(function (panel, index) {
      var group = add(body, 'tr', null, 'group');
      var title = add(group, 'th');
      title.colSpan = COLUMNS.length + 1;
      var link = add(title, 'a', panel.title);
      link.href = '#panel-' + index;
      var front = panel.views[view.value].front;
      add(title, 'span', front.length + ' of ' + panel.rows.length + (panel.rows.length === 1 ? ' run' : ' runs') + ' on the front', 'small');
      var listed = panel.rows.map(function (row, place) { return place; }).filter(function (place) {
        return front.indexOf(place) >= 0 || panel.rows[place].baseline || !panel.rows[place].scored;
      });
      listed.sort(function (a, b) { return panel.rows[a].ms.median - panel.rows[b].ms.median || a - b; });
      var hidden = [];
      var every = Math.ceil(front.length / MOST_ROWS);
      listed.forEach(function (place) {
        var row = panel.rows[place], number = front.indexOf(place);
        var line = add(body, 'tr', null, row.baseline ? 'baseline' : '');
        var cell = add(line, 'td', null, 'left');
        add(cell, 'span', number < 0 ? '' : String(number + 1), 'number');
        cell.appendChild(document.createTextNode(row.name + (row.baseline ? ' (baseline)' : '')));
        COLUMNS.forEach(function (column, nth) {
          var value = add(line, 'td', column[1](row));
          if (nth === 0 && row.repeats)
            add(value, 'span', words.three(row.repeats.min) + '–' + words.three(row.repeats.max) + ' (' + row.repeats.count + '×)', 'spread');
        });
        if (every > 1 && !row.baseline && number % every !== 0 && number + 1 !== front.length) {
          line.hidden = true;
          hidden.push(line);
        }
      });
      if (hidden.length) {
        var more = add(body, 'tr');
        var more_cell = add(more, 'td', null, 'left');
        more_cell.colSpan = COLUMNS.length + 1;
        var button = add(more_cell, 'button', hidden.length + ' more on the front');
        button.type = 'button';
        button.onclick = function () {
          hidden.forEach(function (line) { line.hidden = false; });
          more.remove();
        };
      }
    });
  }

  function fillVerdict() {
    var list = document.querySelector('#verdict dl');
    document.querySelector('#verdict .lack').textContent = model.no_baseline;
    model.panels.forEach(function (panel, index) {
      add(add(list, 'dt'), 'a', panel.title).href = '#panel-' + index;
      var words = add(list, 'dd');
      panel.verdict.sentences.forEach(function (sentence) {
        var line = add(words, 'div');
        if (sentence.run) add(line, 'b', sentence.run);
        line.appendChild(document.createTextNode(sentence.text));
        if (sentence.options) add(line, 'code', 'gsc-play FILE ' + sentence.options);
      });
    });
  }

  function draw(figure) {
    var panel = model.panels[figure.panel], shown = shownOf(figure.panel);
    var built = gscFigures.build(panel, figure.kind, {
      dark: dark.matches, view: view.value, width: figure.box.clientWidth, shown: shown
    });
    figure.box.style.height = built.height + 'px';
    if (figure.note) figure.note.textContent = noteOf(figure, panel, shown);
    if (figure.chart) {
      figure.chart.resize();
    } else {
      figure.chart = echarts.init(figure.box, null, {renderer: 'canvas'});
      figure.chart.on('click', function (hit) { toggle(figure.panel, hit.data && hit.data.row); });
    }
    // the tooltip stays, because it may be on its way to the screen
    figure.chart.setOption(built.option, {replaceMerge: ['title', 'grid', 'xAxis', 'yAxis', 'series', 'legend']});
  }

  function noteOf(figure, panel, shown) {
    if (figure.kind === 'frame-time')
      return 'Median to p95 is the thick part, the thin line ends at the slowest frame.' +
        (panel.rows.length > gscFigures.mostBars ? ' The ' + shown.length + ' runs with a colour, of ' + panel.rows.length + '.' : '');
    if (figure.kind === 'over-time')
      return shown.length < panel.rows.length ? shown.length + ' of ' + panel.rows.length + ' runs; click a point above to add one or take it away.' : '';
    return 'Up and left is better. Shape and colour: ◆ no reuse, ■ depth, ● error, ▲ detail; the shade tells runs apart, the same on the whole page. ' +
      (shown.length < panel.rows.length ? 'With a colour: baselines, the front, and the best of a method that is not on it. Click a point to add its run to the figures below or take it away.' : '');
  }

  function toggle(index, row) {
    if (row === undefined || row === null) return;
    var rows = shownOf(index).slice(), place = rows.indexOf(row);
    if (place < 0) rows.push(row);
    else if (rows.length > 1) rows.splice(place, 1);
    picked[index] = rows;
    redraw(index);
  }

  function redraw(index) {
    figures.forEach(function (figure) {
      if (figure.chart && (index === undefined || figure.panel === index)) draw(figure);
    });
  }

  function drawAll() {
    figures.forEach(function (figure) { if (!figure.chart) draw(figure); });
  }

  function fillPanels() {
    var panels = document.getElementById('panels');
    var watcher = 'IntersectionObserver' in window ? new IntersectionObserver(function (entries) {
      entries.forEach(function (entry) {
        if (!entry.isIntersecting) return;
        watcher.unobserve(entry.target);
        draw(figures.filter(function (figure) { return figure.box === entry.target; })[0]);
      });
    }, {rootMargin: '800px'}) : null;
    model.panels.forEach(function (panel, index) {
      var section = add(panels, 'section');
      section.id = 'panel-' + index;
      add(add(section, 'div', null, 'heading'), 'h2', panel.title);
      add(section, 'p', panel.words, 'small');
      gscFigures.kinds.forEach(function (kind) {
        add(section, 'h3', kind.title);
        var note = add(section, 'p', '', 'small');
        var box = add(section, 'div', null, 'figure');
        box.setAttribute('role', 'img');
        box.setAttribute('aria-label', kind.title + ', ' + panel.title + '; the table above has the numbers');
        box.style.height = '440px';
        var figure = {panel: index, kind: kind.id, box: box, chart: null, note: note};
        figures.push(figure);
        if (watcher) watcher.observe(box);
      });
    });
    if (!watcher) drawAll();
  }

  model.facts.forEach(function (fact) {
    add(document.getElementById('facts'), 'dt', fact[0]);
    add(document.getElementById('facts'), 'dd', fact[1]);
  });
  document.getElementById('version').textContent = model.version;
  fillHead(document.querySelector('#summary thead'));
  fillVerdict();
  fillTable();
  fillPanels();
  view.onchange = function () {
    fillTable();
    redraw();
  };
  dark.addEventListener('change', function () { redraw(); });
  window.addEventListener('beforeprint', drawAll);
  var waiting = 0;
  window.addEventListener('resize', function () {
    window.clearTimeout(waiting);
    waiting = window.setTimeout(redraw, 150);
  });
})();
