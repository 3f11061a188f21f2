// Fills the charts with the columns of the page and links them: cursor, interval, units, overlays, events.
(async function () {
  "use strict";
  const header = JSON.parse(document.getElementById("data").textContent);
  const element = (id) => document.getElementById(id);
  const KNOT = 1852 / 3600;
  const DEGREE = Math.PI / 180;

  function chartDocument() {
    return new Promise((resolve) => {
      const look = () => {
        try {
          const found = Bokeh.documents.find((each) => each.get_model_by_name("map"));
          if (found) return resolve(found);
        } catch {
          // its models are still being made
        }
        setTimeout(look, 10);
      };
      look();
    });
  }

  async function unpacked() {
    const packed = Uint8Array.from(atob(header.bytes), (letter) => letter.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    const bytes = await new Response(stream).arrayBuffer();
    const columns = {};
    let at = 0;
    for (const [name, length, code, first, step] of header.columns) {
      const size = code === "single" ? 4 : 2;
      const coded = bytes.slice(at, at + size * length);
      at += size * length;
      if (code === "single") columns[name] = new Float32Array(coded);
      else {
        const value = code === "linear" ? (n) => first + step * n : (n) => first * Math.exp(step * n);
        columns[name] = Float32Array.from(new Uint16Array(coded), (n) => (n === 65535 ? NaN : value(n)));
      }
    }
    return columns;
  }

  // Pieces of a track in one class of speed, each ending where the next begins; grey where course is not defined.
  const CLASSES = 24;
  function pieces(track) {
    const found = { xs: [], ys: [], speed: [], name: [] };
    const width = header.colours.high / CLASSES;
    // A class is left once the speed is clearly outside of it, so that noise does not cut the track to pieces.
    const kind = (k, now) => {
      if (!Number.isFinite(track.cog[k])) return -1;
      if (now >= 0 && Math.abs(track.sog[k] - (now + 0.5) * width) < width) return now;
      return Math.min(CLASSES - 1, Math.floor(track.sog[k] / width));
    };
    let first = 0, last = kind(0, -1);
    for (let k = 1; k < track.x.length; k++) {
      const next = kind(k, last);
      if (next === last && k < track.x.length - 1) continue;
      found.xs.push(track.x.subarray(first, k + 1));
      found.ys.push(track.y.subarray(first, k + 1));
      found.speed.push(last < 0 ? NaN : (last + 0.5) * width);
      found.name.push("");
      (first = k), (last = next);
    }
    return found;
  }

  const charts = await chartDocument();
  const model = (name) => charts.get_model_by_name(name);
  const map = model("map");
  if (header.vessels) {
    document.body.classList.add("many");
    document.body.dataset.ready = "true";
    return;
  }
  const raw = await unpacked();
  const span = model("time");

  function times(steps) {
    const found = new Float64Array(steps.length);
    let sum = 0;
    for (let k = 0; k < steps.length; k++) {
      sum += steps[k];
      found[k] = 1e3 * (header.begins + sum);
    }
    return found;
  }
  const moved = (values, by) => Float64Array.from(values, (each) => each + by);

  // Courses are drawn on an axis of one turn; a line is lifted where it would cross the whole axis.
  function broken(course) {
    const found = Float32Array.from(course);
    for (let k = 1; k < found.length; k++) if (Math.abs(course[k] - course[k - 1]) > 180) found[k] = NaN;
    return found;
  }

  const rows = { t: times(raw.step), x: moved(raw.x, header.origin[0]), y: moved(raw.y, header.origin[1]) };
  rows.ratio = raw.ratio.map((each, k) => (Math.round(raw.status[k]) === header.rejected ? NaN : each));
  const refused = { t: [], ratio: [], x: [], y: [] };
  raw.status.forEach((each, k) => {
    if (Math.round(each) !== header.rejected) return;
    refused.t.push(rows.t[k]);
    refused.ratio.push(raw.ratio[k]);
    refused.x.push(rows.x[k]);
    refused.y.push(rows.y[k]);
  });
  // Lines are lifted over gaps, and bands closed: an area chart would join what lies on either side.
  const steps = Float32Array.from(raw.step).sort();
  const gap = 5 * Math.max(steps[steps.length >> 1], 0.1);
  const lifted = (values) => values.map((each, k) => (k > 0 && raw.step[k] > gap ? NaN : each));
  function band(values, std, whole) {
    const found = { t: [], low: [], high: [] };
    let last = -1;
    const add = (t, low, high) => (found.t.push(t), found.low.push(low), found.high.push(high));
    for (let k = 0; k < values.length; k++) {
      if (!Number.isFinite(values[k] + std[k])) continue;
      const apart = last >= 0 && (k > last + 1 || raw.step[k] > gap || Math.abs(values[k] - values[last]) > whole);
      if (apart) {
        add(rows.t[last] + 0.5, values[last], values[last]);
        add(rows.t[k] - 0.5, values[k], values[k]);
      }
      add(rows.t[k], values[k] - 2 * std[k], values[k] + 2 * std[k]);
      last = k;
    }
    return found;
  }
  const bands = {
    sog: band(raw.sog, raw.sog_std, Infinity),
    cog: band(raw.cog, raw.cog_std, 180),
    rate: band(raw.rate, raw.rate_std, Infinity),
  };
  rows.sog = lifted(raw.sog);
  rows.cog = lifted(broken(raw.cog));
  rows.rate = lifted(raw.rate);

  const fixes = { t: times(raw.fix_step), x: moved(raw.fix_x, header.origin[0]), y: moved(raw.fix_y, header.origin[1]) };
  const reported = { t: times(raw.reported_step), sog: raw.reported_sog, cog: broken(raw.reported_cog) };
  function differenced() {
    const count = Math.max(fixes.t.length - 1, 0);
    const found = { t: new Float64Array(count), sog: new Float32Array(count), cog: new Float32Array(count) };
    for (let k = 0; k < count; k++) {
      const east = (raw.fix_x[k + 1] - raw.fix_x[k]) / header.scale[0];
      const north = (raw.fix_y[k + 1] - raw.fix_y[k]) / header.scale[1];
      const elapsed = (fixes.t[k + 1] - fixes.t[k]) / 1e3;
      found.t[k] = 0.5 * (fixes.t[k] + fixes.t[k + 1]);
      found.sog[k] = elapsed > 0 ? Math.hypot(east, north) / elapsed : NaN;
      const course = Math.atan2(east, north) / DEGREE - header.cut;
      found.cog[k] = found.sog[k] > 0.2 ? header.cut + course - 360 * Math.floor(course / 360) : NaN;
    }
    found.cog = broken(found.cog);
    return found;
  }
  const differences = differenced();

  const strips = ["sog", "cog", "rate", "ratio"].filter((name) => model(name));
  const innovations = strips.includes("ratio");
  const truth = raw.true_sog && { sog: raw.true_sog, cog: broken(raw.true_cog), rate: raw.true_rate };
  const SPEEDS = [[rows, ["sog"]], ...(truth ? [[truth, ["sog"]]] : []), [bands.sog, ["low", "high"]], [reported, ["sog"]], [differences, ["sog"]]];
  function show() {
    model("differences").data = { ...differences };
  }
  show();
  // Of many dots only as many as can be distinguished.
  const DOTS = 3000;
  function dotted(name, table, keys) {
    const first = at(table.t, span.start), last = at(table.t, span.end);
    const every = Math.max(1, Math.ceil((last - first) / DOTS));
    const chosen = (values) => (every === 1 ? values.slice(first, last) : values.slice(first, last).filter((_, k) => k % every === 0));
    model(name).data = Object.fromEntries(keys.map((key) => [key, chosen(table[key])]));
  }
  model("pieces").data = pieces({ x: rows.x, y: rows.y, cog: raw.cog, sog: raw.sog });
  if (innovations) model("refused").data = { t: refused.t, ratio: refused.ratio };
  if (truth) {
    model("true_track").data = { x: moved(raw.true_x, header.origin[0]), y: moved(raw.true_y, header.origin[1]) };
  }
  model("rejected").data = { x: refused.x, y: refused.y };
  model("fixes").data = { x: fixes.x, y: fixes.y };

  // The rows of an interval: from the first at or after `start` to the last before `stop`.
  function at(time, moment) {
    let low = 0, high = time.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (time[middle] < moment) low = middle + 1;
      else high = middle;
    }
    return low;
  }
  function extent(time, values, span, range) {
    for (let k = at(time, span.start); k < at(time, span.end); k++) {
      const each = values[k];
      if (each < range[0]) range[0] = each;
      if (each > range[1]) range[1] = each;
    }
    return range;
  }

  // Of many rows the least and the largest of each stretch, which look the same; all around a break.
  const POINTS = 1500;
  function outline(time, low, high, name) {
    const first = Math.max(at(time, span.start) - 1, 0), last = Math.min(at(time, span.end) + 1, time.length);
    const every = Math.floor((last - first) / POINTS);
    const found = { t: [], low: [], high: [] };
    const add = (t, l, h) => (found.t.push(t), found.low.push(l), found.high.push(h));
    for (let k = first; k < last; k += Math.max(every, 1)) {
      const stop = Math.min(k + every, last);
      let least = k, most = k, whole = every > 4;
      for (let j = k; j < stop; j++) {
        if (!(low[j] === low[j] && high[j] === high[j])) whole = false;
        if (low[j] < low[least]) least = j;
        if (high[j] > high[most]) most = j;
      }
      if (!whole) for (let j = k; j < Math.max(stop, k + 1); j++) add(time[j], low[j], high[j]);
      else if (!name) add(time[k], low[least], high[most]);
      else for (const j of least < most ? [least, most] : [most, least]) add(time[j], low[j], high[j]);
    }
    return name ? { t: found.t, [name]: found.low } : found;
  }

  const whole = [span.start, span.end];
  const shownTracks = { reported: true, differences: false };
  function fit() {
    const none = () => [Infinity, -Infinity];
    const set = (name, range, least, floor) => {
      if (!(range[1] >= range[0])) return;
      const margin = Math.max(0.06 * (range[1] - range[0]), least);
      model(name).y_range.setv({ start: floor === undefined ? range[0] - margin : Math.max(floor, range[0] - margin), end: range[1] + margin });
    };
    let sog = extent(rows.t, rows.sog, span, none());
    if (shownTracks.reported) sog = extent(reported.t, reported.sog, span, sog);
    const wide = extent(bands.sog.t, bands.sog.high, span, none())[1];
    const limit = sog[1] + Math.max(0.5 * (sog[1] - sog[0]), 0.3);
    sog[1] = Math.min(Math.max(sog[1], wide), limit);
    set("sog", sog, 0.05, 0);
    const turn = extent(rows.t, rows.cog, span, none());
    set("cog", turn, turn[1] - turn[0] > 300 ? 0 : 5);
    const rate = extent(rows.t, rows.rate, span, none());
    set("rate", rate, Math.max(0.3, 0.25 * (rate[1] - rate[0])));
    if (innovations) {
    let ratio = extent(rows.t, rows.ratio, span, none());
    ratio = [Math.max(0.01, ratio[0]), Math.max(ratio[1], 1.5 * header.gate)];
    for (const each of refused.ratio) ratio[1] = Math.max(ratio[1], each);
    model("ratio").y_range.setv({ start: ratio[0] / 1.2, end: 1.3 * ratio[1] });
    dotted("accepted", rows, ["t", "ratio"]);
    }
    for (const name of Object.keys(bands)) {
      model("line_" + name).data = outline(rows.t, rows[name], rows[name], "value");
      model("band_" + name).data = outline(bands[name].t, bands[name].low, bands[name].high);
      if (truth) model("true_" + name).data = outline(rows.t, truth[name], truth[name], "value");
    }
    dotted("reported", reported, ["t", "sog", "cog"]);
    const first = at(rows.t, span.start), last = at(rows.t, span.end);
    const all = first === 0 && last === rows.t.length;
    model("window").data = all ? { x: [], y: [] } : { x: rows.x.slice(first, last), y: rows.y.slice(first, last) };
  }
  let waiting = false;
  function later() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      fit();
    });
  }
  span.properties.start.change.connect(later);
  span.properties.end.change.connect(later);
  fit();

  // Cursor
  const cursors = strips.map((name) => model(name).center.find((each) => each.name === "cursor"));
  let unit = { factor: 1, name: "m/s" };
  const number = (value, digits) => (Number.isFinite(value) ? value.toFixed(digits) : "–");
  function degrees(value, positive, negative) {
    return `${Math.abs(value).toFixed(6)}° ${value >= 0 ? positive : negative}`;
  }
  function words(k) {
    const latitude = Math.atan(Math.sinh(rows.y[k] / 6378137)) / DEGREE;
    const turned = rows.x[k] / 6378137 / DEGREE;
    const longitude = turned - 360 * Math.floor((turned + 180) / 360);
    const course = ((raw.cog[k] % 360) + 360) % 360;
    return [
      `${new Date(rows.t[k]).toISOString().slice(0, 23).replace("T", " ")} UTC`,
      `${degrees(latitude, "N", "S")}, ${degrees(longitude, "E", "W")} ± ${number(2 * raw.position_std[k], 2)} m`,
      `SOG ${number(raw.sog[k] * unit.factor, 3)} ± ${number(2 * raw.sog_std[k] * unit.factor, 3)} ${unit.name}`,
      `COG ${number(course, 1)} ± ${number(2 * raw.cog_std[k], 1)}°`,
      `course rate ${number(raw.rate[k], 2)} ± ${number(2 * raw.rate_std[k], 2)} °/s`,
      ...(innovations ? [`innovation ratio ${number(raw.ratio[k], 2)}`] : []),
      ...(truth ? [`true: ${number(truth.sog[k], 3)} ${unit.name}, ${number(((raw.true_cog[k] % 360) + 360) % 360, 1)}°`] : []),
      header.statuses[Math.round(raw.status[k])],
    ].join(" · ");
  }
  function point(k, fromSlider) {
    if (k < 0 || k >= rows.t.length) return;
    for (const each of cursors) each.setv({ location: rows.t[k], visible: true });
    model("map_cursor").data = { x: [rows.x[k]], y: [rows.y[k]] };
    element("values").textContent = words(k);
    if (!fromSlider) element("moment").value = k;
  }
  element("moment").max = rows.t.length - 1;
  element("moment").addEventListener("input", (event) => point(Number(event.target.value), true));
  function nearest(moment) {
    const k = at(rows.t, moment);
    if (k === 0) return 0;
    return k >= rows.t.length || moment - rows.t[k - 1] < rows.t[k] - moment ? k - 1 : k;
  }
  function nearestPlace(x, y) {
    let best = -1, least = Infinity;
    for (let k = 0; k < rows.t.length; k++) {
      const apart = (rows.x[k] - x) ** 2 + (rows.y[k] - y) ** 2;
      if (apart < least) (least = apart), (best = k);
    }
    return best;
  }
  for (const name of strips) {
    model(name).on_event("mousemove", (event) => point(nearest(event.x)));
    model(name).on_event("tap", (event) => point(nearest(event.x)));
  }
  map.on_event("mousemove", (event) => point(nearestPlace(event.x, event.y)));
  map.on_event("tap", (event) => point(nearestPlace(event.x, event.y)));

  // Intervals
  function look(start, end) {
    const width = Math.min(end - start, whole[1] - whole[0]);
    const from = Math.min(Math.max(start, whole[0]), whole[1] - width);
    span.setv({ start: from, end: from + width });
  }
  const width = () => span.end - span.start;
  const middle = () => 0.5 * (span.start + span.end);
  element("earlier").onclick = () => look(span.start - 0.5 * width(), span.end - 0.5 * width());
  element("later").onclick = () => look(span.start + 0.5 * width(), span.end + 0.5 * width());
  element("closer").onclick = () => look(middle() - 0.25 * width(), middle() + 0.25 * width());
  element("wider").onclick = () => look(middle() - width(), middle() + width());
  element("whole").onclick = () => look(...whole);
  for (const each of document.querySelectorAll("[data-event]")) {
    each.onclick = () => {
      const [start, stop] = header.events[Number(each.dataset.event)];
      const around = Math.max(2 * (stop - start), 20);
      look(1e3 * (start - around), 1e3 * (stop + around));
      point(nearest(1e3 * start));
      const first = at(rows.t, 1e3 * (start - around)), last = at(rows.t, 1e3 * (stop + around));
      if (last <= first) return;
      const bounds = (values) => extent(rows.t, values, { start: 1e3 * (start - around), end: 1e3 * (stop + around) }, [Infinity, -Infinity]);
      const x = bounds(rows.x), y = bounds(rows.y);
      const half = 0.65 * Math.max(x[1] - x[0], y[1] - y[0], 10 * header.scale[0]);
      const centre = [0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1])];
      const shape = map.inner_width / map.inner_height || 1;
      map.x_range.have_updated_interactively = map.y_range.have_updated_interactively = true;
      map.x_range.setv({ start: centre[0] - half * Math.max(shape, 1), end: centre[0] + half * Math.max(shape, 1) });
      map.y_range.setv({ start: centre[1] - half / Math.min(shape, 1), end: centre[1] + half / Math.min(shape, 1) });
    };
  }

  // Units and overlays
  for (const each of document.querySelectorAll("input[name=unit]")) {
    each.onchange = () => {
      const next = each.value === "kn" ? { factor: 1 / KNOT, name: "kn" } : { factor: 1, name: "m/s" };
      const change = next.factor / unit.factor;
      unit = next;
      for (const [table, names] of SPEEDS) for (const name of names) table[name] = table[name].map((value) => value * change);
      show();
      model("sog").left[0].axis_label = `SOG (${unit.name})`;
      element("fastest").textContent = `${(header.colours.high * unit.factor).toPrecision(2)} ${unit.name}`;
      fit();
      point(Number(element("moment").value), true);
    };
  }
  function toggled(name, renderers) {
    element("show_" + name).onchange = (event) => {
      for (const each of renderers) model(each).visible = event.target.checked;
      shownTracks[name] = event.target.checked;
      fit();
    };
  }
  toggled("reported", ["reported_sog", "reported_cog"]);
  toggled("differences", ["differences_sog", "differences_cog"]);
  toggled("fixes", ["fix_dots"]);
  toggled("tiles", ["tiles"]);
  requestAnimationFrame(() => setTimeout(() => (document.body.dataset.ready = Math.round(performance.now()))));
})();
