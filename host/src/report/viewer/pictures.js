// The pictures of the keyframe nearest to a frame, and the tracks on its left image.
const STATE_COLOURS = { uncertain: "#9aa0aa", static: "#3a7bd5", dynamic: "#e8590c" };

// A picture of the page as an address; null where the run has none. Made once: the text is decoded when the picture is first looked at.
const PICTURE_URLS = new Map();
function pictureUrl(frame, name, kind) {
  const id = `dynvox-${String(frame).padStart(6, "0")}_${name}`;
  if (!PICTURE_URLS.has(id)) {
    const element = document.getElementById(id), text = element && atob(element.textContent);
    const bytes = text && Uint8Array.from(text, (character) => character.charCodeAt(0));
    PICTURE_URLS.set(id, bytes && URL.createObjectURL(new Blob([bytes], { type: `image/${kind}` })));
  }
  return PICTURE_URLS.get(id);
}

async function loaded(url) {
  if (!url) return null;
  const image = new Image();
  image.src = url;
  await image.decode();
  return image;
}

class Pictures {
  constructor(root, head) {
    this.head = head;
    this.left = root.querySelector("canvas.left");
    this.others = ["disparity", "map"].map((name) => ({ name, image: root.querySelector(`img.${name}`) }));
    this.captions = [...root.querySelectorAll(".side figcaption")].map((element) => ({ element, text: element.textContent }));
    this.shown = null;
    root.querySelector(".side").hidden = head.pictures.length === 0;
  }

  // Number of the keyframe nearest to a frame's number.
  nearest(frame) {
    return this.head.pictures.reduce((best, one) => (best === null || Math.abs(one - frame) < Math.abs(best - frame) ? one : best), null);
  }

  async show(frame, { masks, tracks }) {
    const keyframe = this.nearest(frame), key = `${keyframe} ${masks} ${tracks}`;
    if (keyframe === null || key === this.shown) return;
    const before = this.shown === null ? null : Number(this.shown.split(" ")[0]);
    this.shown = key;
    if (before !== keyframe) {
      this.captions.forEach(({ element, text }) => { element.textContent = `${text}, frame ${keyframe}`; });
      for (const { name, image } of this.others) {
        const url = pictureUrl(keyframe, `${name}.jpg`, "jpeg");
        image.parentElement.hidden = !url;
        if (url) image.src = url;
      }
    }
    const [left, mask] = await Promise.all([
      loaded(pictureUrl(keyframe, "left.jpg", "jpeg")),
      loaded(masks ? pictureUrl(keyframe, "masks.png", "png") : null),
    ]);
    // Another frame may have been asked for meanwhile.
    if (left && this.shown === key) this.paint(left, mask, tracks ? this.tracksOf(keyframe) : []);
  }

  tracksOf(frame) {
    return this.head.tracks[this.head.frames.indexOf(frame)] || [];
  }

  paint(left, mask, tracks) {
    const canvas = this.left, context = canvas.getContext("2d");
    if (!context) return;
    Object.assign(canvas, { width: left.naturalWidth, height: left.naturalHeight });
    context.drawImage(left, 0, 0);
    if (mask) context.drawImage(mask, 0, 0, canvas.width, canvas.height);
    const ratio = canvas.width / (this.head.image[0] || canvas.width);
    context.font = "12px system-ui, sans-serif";
    context.lineWidth = 1.5;
    for (const [id, name, state, [x1, y1, x2, y2], speed] of tracks) {
      context.strokeStyle = context.fillStyle = STATE_COLOURS[state] || "#fff";
      context.strokeRect(x1 * ratio, y1 * ratio, (x2 - x1) * ratio, (y2 - y1) * ratio);
      const text = `${id} ${name}` + (speed === null ? "" : ` ${speed} m/s`), width = context.measureText(text).width + 6;
      const x = clamp(x1 * ratio, 0, canvas.width - width), y = Math.max(y1 * ratio, 15);
      context.fillRect(x, y - 15, width, 15);
      context.fillStyle = "#fff";
      context.fillText(text, x + 3, y - 4);
    }
  }
}
