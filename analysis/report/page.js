"use strict";
// Draws the pair that was clicked. No library, no network: data sits in the page.
const DATA = JSON.parse(document.getElementById("data").textContent);
const COLORS = { forward: "#1f6fb2", reverse: "#d9690f", stranger: "#8a8f98" };

const bytes = (text, signed) => {
  const raw = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return signed ? new Int8Array(raw.buffer) : raw;
};

function prepare(figure) {
  const canvas = figure.querySelector("canvas");
  const scale = window.devicePixelRatio || 1;
  const width = figure.clientWidth || 320, height = Math.round(width * 0.55);
  canvas.width = width * scale; canvas.height = height * scale;
  const pen = canvas.getContext("2d");
  pen.scale(scale, scale); pen.clearRect(0, 0, width, height);
  pen.font = "11px sans-serif"; pen.lineWidth = 1.2;
  pen.fillStyle = pen.strokeStyle = getComputedStyle(document.body).color;
  return { pen, width, height };
}

function axis({ pen, width, height }, seconds, unit, top, bottom) {
  pen.globalAlpha = 0.75;
  for (let k = 0; k <= 4; k++) {
    const x = 34 + (width - 44) * k / 4;
    const words = (1000 * seconds * k / 4).toFixed(0) + (k == 4 ? " ms" : "");
    pen.textAlign = k == 4 ? "right" : "center"; pen.fillText(words, x, height - 4);
  }
  pen.textAlign = "left"; pen.fillText(top, 2, 14); pen.fillText(bottom, 2, height - 20);
  pen.fillText(unit, 2, 28); pen.globalAlpha = 1;
}

function line({ pen, width, height }, values, color, toY) {
  pen.strokeStyle = color; pen.globalAlpha = 0.85; pen.beginPath();
  values.forEach((v, k) => {
    const x = 34 + (width - 44) * k / (values.length - 1);
    pen[k ? "lineTo" : "moveTo"](x, toY(v, height - 18));
  });
  pen.stroke(); pen.globalAlpha = 1;
}

function drawWave(figure, curves, seconds, zoom) {
  const frame = prepare(figure);
  for (const [color, text] of curves) {
    const all = bytes(text, true);
    line(frame, all.slice(0, Math.max(2, Math.round(all.length * zoom))), color,
      (v, h) => h / 2 - (h / 2 - 8) * v / 127);
  }
  axis(frame, seconds * zoom, "", "+1", "-1");
}

function drawDecay(figure, curves, seconds) {
  const frame = prepare(figure);
  for (const [color, text] of curves)
    line(frame, bytes(text), color, (v, h) => 6 + (h - 8) * Math.min(v * 0.4, 80) / 80);
  axis(frame, seconds, "dB", "0", "-80");
}

function drawSpectrogram(figure, text, seconds, nyquist) {
  const frame = prepare(figure), values = bytes(text), rows = 64, columns = 80;
  const w = (frame.width - 44) / columns, h = (frame.height - 18) / rows;
  for (let r = 0; r < rows; r++) for (let c = 0; c < columns; c++) {
    const level = Math.max(0, 1 - values[r * columns + c] * 0.4 / 80);
    frame.pen.fillStyle = `hsl(${260 - 220 * level} 80% ${8 + 52 * level}%)`;
    frame.pen.fillRect(34 + c * w, (rows - 1 - r) * h, w + 0.6, h + 0.6);
  }
  frame.pen.fillStyle = getComputedStyle(document.body).color;
  axis(frame, seconds, "kHz", (nyquist / 1000).toFixed(0), "0");
}

function drawPair(section, room, index, zoom) {
  const pair = room.pairs[index], other = room.pairs[(index + 1) % room.pairs.length];
  const detail = section.querySelector(".detail");
  detail.hidden = false;
  detail.querySelector("h3").textContent = "Pair " + pair.pair;
  detail.querySelector(".note").textContent = pair.note;
  const of = (kind) => detail.querySelector(`[data-figure="${kind}"]`);
  const f = pair.forward, r = pair.reverse;
  const seconds = room.duration, shown = Math.min(seconds, room.wave_seconds);
  drawWave(of("paired"), [[COLORS.forward, f.wave], [COLORS.reverse, r.wave]], shown, zoom);
  drawWave(of("unpaired"),
    [[COLORS.forward, f.wave], [COLORS.stranger, other.reverse.wave]], shown, zoom);
  drawDecay(of("decay"), [[COLORS.stranger, other.reverse.decay],
    [COLORS.forward, f.decay], [COLORS.reverse, r.decay]], seconds);
  drawSpectrogram(of("spectrogram-forward"), f.spectrogram, seconds, room.nyquist);
  drawSpectrogram(of("spectrogram-reverse"), r.spectrogram, seconds, room.nyquist);
  section.querySelectorAll("tr[data-pair], g[data-pair]").forEach((row) =>
    row.classList.toggle("chosen", Number(row.dataset.pair) === index));
}

document.querySelectorAll("section[data-room]").forEach((section) => {
  const room = DATA.rooms[Number(section.dataset.room)];
  const slider = section.querySelector("input[type=range]");
  let chosen = 0;
  const draw = () => drawPair(section, room, chosen, Number(slider.value) / 100);
  section.querySelectorAll("[data-pair]").forEach((mark) => {
    const choose = (event) => {
      event.preventDefault(); chosen = Number(mark.dataset.pair); draw();
      if (mark.tagName !== "TR") section.querySelector(".detail").scrollIntoView({ block: "nearest" });
    };
    mark.addEventListener("click", choose);
    mark.addEventListener("keydown", (event) => { if (event.key === "Enter") choose(event); });
  });
  slider.addEventListener("input", draw);
  window.addEventListener("resize", draw);
  if (room.pairs.length) draw();
});
document.body.dataset.ready = "yes";
