// The picture of the robot's camera with the outlines of what it has estimated.

const MOST_LABELS = 3;
const CAMERA = { bitmaps: new Map(), most: 80 };

// Decode a JPEG without an address, so that the page makes no request at all.
function bitmapOf(index, picture, whenReady) {
  const held = CAMERA.bitmaps.get(index);
  if (held) return held.image;
  const entry = { image: null };
  CAMERA.bitmaps.set(index, entry);
  if (CAMERA.bitmaps.size > CAMERA.most) {
    const oldest = CAMERA.bitmaps.keys().next().value;
    CAMERA.bitmaps.delete(oldest);
  }
  const bytes = Uint8Array.from(atob(picture.jpeg), (letter) => letter.charCodeAt(0));
  createImageBitmap(new Blob([bytes], { type: "image/jpeg" })).then((image) => {
    entry.image = image;
    whenReady();
  });
  return null;
}

function drawCamera(canvas, begin, states, index, layers, whenReady) {
  canvas.style.aspectRatio = String(begin.picture_aspect);
  const { pen, width, height } = prepare(canvas);
  const at = lastPicture(states, index);
  if (at < 0) return false;
  const picture = states[at].picture;
  let image = bitmapOf(at, picture, whenReady);
  // While a picture is decoded, the one before it is shown.
  if (!image && CAMERA.shown) image = CAMERA.shown;
  if (!image) return true;
  CAMERA.shown = image;
  pen.drawImage(image, 0, 0, width, height);
  if (at + 1 < states.length) {
    const next = states.findIndex((state, number) => number > at && state.picture);
    if (next > 0) bitmapOf(next, states[next].picture, whenReady);
  }
  if (layers.rings) {
    for (const ring of picture.rings) {
      pen.strokeStyle = BRIGHT(ring.awareness_lower);
      pen.lineWidth = 2;
      for (const run of ring.outline) trace(pen, run, width, height);
    }
  }
  // The labels of people far away would cover each other.
  const area = ({ box }) => (box.length ? (box[2] - box[0]) * (box[3] - box[1]) : 0);
  const near = [...picture.seen].sort((one, other) => area(other) - area(one));
  for (const seen of near.slice().reverse()) {
    const colour = BRIGHT(seen.awareness);
    if (layers.cones && seen.cone.length) {
      trace(pen, seen.cone, width, height, true);
      pen.fillStyle = BRIGHT(seen.awareness, 0.4);
      pen.fill();
      pen.strokeStyle = colour;
      pen.lineWidth = 1.5;
      pen.stroke();
    }
    if (layers.tracks && seen.box.length) {
      const [left, top, right, bottom] = seen.box;
      pen.strokeStyle = colour;
      pen.lineWidth = 2;
      pen.strokeRect(left * width, top * height, (right - left) * width, (bottom - top) * height);
      const text = seen.awareness === null ? "no face seen"
        : `α ${seen.awareness.toFixed(2)} ± ${seen.awareness_std.toFixed(2)}`;
      if (near.indexOf(seen) < MOST_LABELS) label(pen, text, left * width, top * height, width);
    }
  }
  return true;
}

function lastPicture(states, index) {
  for (let at = index; at >= 0; at -= 1) if (states[at].picture) return at;
  return -1;
}

function trace(pen, run, width, height, closed = false) {
  pen.beginPath();
  for (let at = 0; at < run.length; at += 2) pen.lineTo(run[at] * width, run[at + 1] * height);
  if (closed) pen.closePath();
  else pen.stroke();
}

// Over a picture, which is the same in light and dark, the colours are always the bright ones.
function BRIGHT(alpha, opacity = 1) {
  if (alpha === null) return `rgb(190 195 203 / ${opacity})`;
  const ramp = [[255, 92, 80], [246, 178, 60], [74, 214, 140]];
  const half = alpha < 0.5 ? 0 : 1, share = Math.min(Math.max(2 * alpha - half, 0), 1);
  const mixed = ramp[half].map((low, at) => Math.round(low + share * (ramp[half + 1][at] - low)));
  return `rgb(${mixed.join(" ")} / ${opacity})`;
}

function label(pen, text, left, top, width) {
  font(pen, 12.5, 600);
  pen.textAlign = "left";
  const wide = pen.measureText(text).width + 10;
  const u = Math.min(Math.max(left, 0), width - wide), v = Math.max(top - 21, 0);
  pen.fillStyle = "rgb(15 18 22 / .82)";
  pen.fillRect(u, v, wide, 19);
  pen.fillStyle = "#ffffff";
  pen.fillText(text, u + 5, v + 14);
}
