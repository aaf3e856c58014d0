"use strict";
/* The live connection: shows what the bench says, and answers, which keeps the seat. */
const SHOWN_S = 30;
const STALE_S = 1.5;
let live = null;
let trace = [];
let pictureUrl = null;

function studioLive(session, watch) {
  if (live) { live.onclose = null; live.close(); }
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  const socket = new WebSocket(
    `${scheme}://${location.host}/live?session=${encodeURIComponent(session)}&watch=${watch}`);
  live = socket;
  socket.binaryType = "blob";
  socket.onmessage = (event) => {
    if (event.data instanceof Blob) { showPicture(event.data); return; }
    socket.send("heard");
    showBench(JSON.parse(event.data));
  };
  socket.onclose = () => {
    tell("summary", "connection lost: a bench that this browser controls is vented");
    allow([]);
    setTimeout(() => { if (live === socket) studioLive(session, watch); }, 1000);
  };
}

const shown = (name) => document.querySelector(`[data-live="${name}"]`);

function tell(name, text) {
  const element = shown(name);
  if (element && element.textContent !== text) element.textContent = text;
  return element;
}

function tellIfAny(name, text) {
  const element = tell(name, text);
  if (element) element.hidden = !text;
}

/* What cannot be asked for now has its button closed; the server refuses it as well. */
function allow(asks) {
  for (const button of document.querySelectorAll("[data-needs]")) {
    const closed = !asks.includes(button.dataset.needs);
    if (button.disabled !== closed) button.disabled = closed;
  }
}

function showBench(news) {
  const fault = news.fault === "none" ? "" : `Fault ${news.fault.replaceAll("_", " ")}. ${news.hint}`;
  tell("summary", news.connected ? `${news.connected}: ${news.state}${fault ? ", fault" : ""}` : "");
  if (!shown("control")) return;
  allow(news.may);
  tell("control", news.control);
  tell("state", news.connected ? news.state : "no bench");
  tell("flags", news.connected ? news.flags : "");
  tell("force", fixed(news.force, 2));
  const known = news.connected && news.deformation !== null;
  tell("deformation", known ? `${fixed(news.deformation, news.decimals)} ${news.unit}` : "-");
  tellIfAny("fault", fault);
  tellIfAny("said", news.said);
  tellIfAny("question", news.question ? `${news.question}, then press "Done as asked".` : "");
  tell("doing", news.total ? `${news.done} of ${news.total} points. ${news.doing}` : news.doing);
  const progress = shown("progress");
  progress.max = news.total || 1;
  progress.value = news.done;
  if (!news.connected) {  // what was said last is no longer so
    for (const name of ["time", "pressure", "setpoint", "plunger"]) tell(name, "-");
    tell("notes", "");
  }
  if (!news.samples.length) return;
  const first = news.samples[0];
  if (trace.length && first[0] < trace[trace.length - 1][0]) trace = [];
  trace.push(...news.samples);
  const last = trace[trace.length - 1];
  while (trace[0][0] < last[0] - SHOWN_S) trace.shift();
  drawTrace();
  if (!news.connected) return;
  tell("time", fixed(last[0], 1));
  tell("pressure", fixed(last[1], 2));
  tell("setpoint", fixed(last[2], 2));
  tell("plunger", fixed(last[3], 2));
  tell("notes", notes(news, last[0]));
}

/* A number without a minus before zeros; a dash for none. */
function fixed(value, digits) {
  return value === null ? "-" : value.toFixed(digits).replace(/^-(?=[0.]*$)/, "");
}

function notes(news, now) {
  const said = [];
  const age = now - news.deformation_s;
  if (news.no_deformation) said.push(`No ${news.quantity}: ${news.no_deformation}.`);
  else if (news.deformation !== null) {
    said.push(`The ${news.quantity} is known within ` +
      `${news.deformation_u95.toPrecision(2)} ${news.unit} (95 %)` +
      (age > STALE_S ? `, from a picture ${age.toFixed(0)} s old.` : "."));
  }
  if (news.force === null && news.connected) said.push("No force: the load cell is not tared.");
  return said.join(" ");
}

function drawTrace() {
  const canvas = shown("trace");
  const style = getComputedStyle(document.body);
  const colour = (name) => style.getPropertyValue(name).trim();
  // in the pixels of the screen: letters stay readable where the page is narrow
  const width = canvas.width = canvas.clientWidth, height = canvas.height = canvas.clientHeight;
  const left = 52, bottom = 24, top = 24;
  const pen = canvas.getContext("2d");
  const end = trace[trace.length - 1][0];
  let low = 0, high = 1;
  for (const [, pressure, setpoint] of trace) {
    low = Math.min(low, pressure);
    high = Math.max(high, pressure, setpoint);
  }
  const step = [0.2, 0.5, 1, 2, 5, 10].find((s) => (high - low) / s <= 6) || 20;
  high = Math.ceil(high / step) * step;
  low = Math.floor(low / step) * step;
  const x = (time) => left + (width - left - 6) * (1 - (end - time) / SHOWN_S);
  const y = (kpa) => top + (height - bottom - top) * (1 - (kpa - low) / (high - low));
  pen.clearRect(0, 0, width, height);
  pen.font = "14px system-ui, sans-serif";
  pen.fillStyle = colour("--ink");
  pen.strokeStyle = colour("--line");
  pen.lineWidth = 1;
  for (let kpa = low; kpa <= high + 1e-9; kpa += step) {
    pen.beginPath(); pen.moveTo(left, y(kpa)); pen.lineTo(width, y(kpa)); pen.stroke();
    pen.fillText(kpa.toFixed(step < 1 ? 1 : 0), 18, y(kpa) + 5);
  }
  pen.fillText("kPa", 0, 14);
  pen.fillText(`${end.toFixed(0)} s`, width - 50, height - 6);
  const line = (column, name, dashes) => {
    pen.strokeStyle = colour(name);
    pen.setLineDash(dashes);
    pen.lineWidth = 2;
    pen.beginPath();
    for (const sample of trace) pen.lineTo(x(sample[0]), y(sample[column]));
    pen.stroke();
    pen.setLineDash([]);
  };
  line(2, "--series-2", [8, 5]);
  line(1, "--series-1", []);
}

function showPicture(blob) {
  const image = shown("camera");
  if (!image) return;
  const before = pictureUrl;
  pictureUrl = URL.createObjectURL(blob);
  image.onload = () => { if (before) URL.revokeObjectURL(before); };
  image.src = pictureUrl;
  image.hidden = false;
}
