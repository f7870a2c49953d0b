// Pairs of grey pictures out of a person's files.
const IS_RIGHT = /(^|[\/_.-])(right|cam1|image_0?[13])(?=[\/_.\d-])|[\/_.-]r[_-]?\d*\.[a-z]+$/i;

// Grey values of what a canvas shows, as the luma of ITU-R BT.601.
function greyOf(context, width, height) {
  const { data } = context.getImageData(0, 0, width, height), grey = new Uint8Array(width * height);
  for (let at = 0; at < grey.length; at++) grey[at] = (299 * data[4 * at] + 587 * data[4 * at + 1] + 114 * data[4 * at + 2] + 500) / 1000;
  return grey;
}

// A part of a picture, shrunk and in grey.
class Shrink {
  constructor(fullWidth, fullHeight, widest) {
    const share = Math.min(widest / fullWidth, 1);
    Object.assign(this, { share, width: Math.round(fullWidth * share), height: Math.round(fullHeight * share), fullWidth, fullHeight });
    this.context = Object.assign(document.createElement("canvas"), { width: this.width, height: this.height }).getContext("2d", { willReadFrequently: true });
  }

  grey(picture, fromX) {
    this.context.drawImage(picture, fromX, 0, this.fullWidth, this.fullHeight, 0, 0, this.width, this.height);
    return greyOf(this.context, this.width, this.height);
  }
}

// A video whose pictures hold both cameras side by side.
async function videoSource(file, { rate, width }) {
  const video = Object.assign(document.createElement("video"), { muted: true, src: URL.createObjectURL(file) });
  await new Promise((resolve, reject) => {
    video.onloadeddata = resolve;
    video.onerror = () => reject(new Error(`${file.name} cannot be decoded by this browser. Convert it: ffmpeg -i ${file.name} -c:v libx264 video.mp4`));
  });
  const shrink = new Shrink(video.videoWidth >> 1, video.videoHeight, width);
  let at = 0;
  const next = async () => {
    const time = at++ / rate;
    if (time >= video.duration) return null;
    if (time > 0) await new Promise((resolve) => { video.onseeked = resolve; video.currentTime = time; });
    return [0, shrink.fullWidth].map((from) => shrink.grey(video, from));
  };
  return { shrink, next };
}

// Left and right pictures, in the order of their names.
async function pairSource(files, { width }) {
  const named = files.map((file) => ({ file, name: file.path || file.webkitRelativePath || file.name })).sort((a, b) => (a.name < b.name ? -1 : 1));
  const right = named.filter(({ name }) => IS_RIGHT.test(name)), left = named.filter(({ name }) => !IS_RIGHT.test(name));
  if (!left.length || left.length !== right.length) {
    throw new Error(`${left.length} left and ${right.length} right images: give as many of each, in folders called left and right`);
  }
  const first = await createImageBitmap(left[0].file), shrink = new Shrink(first.width, first.height, width);
  let at = 0;
  const next = async () => {
    if (at >= left.length) return null;
    const pictures = await Promise.all([left[at], right[at]].map(({ file }) => createImageBitmap(file)));
    at++;
    return pictures.map((picture) => shrink.grey(picture, 0));
  };
  return { shrink, next };
}

const sourceOf = (files, settings) => {
  const video = files.find((file) => file.type.startsWith("video/") || /\.(mp4|webm|mov|mkv|avi)$/i.test(file.name));
  return video ? videoSource(video, settings) : pairSource(files.filter((file) => file.type.startsWith("image/")), settings);
};

// All files of a drop, those of folders with their paths.
async function droppedFiles(transfer) {
  const files = [];
  const walk = async (entry) => {
    if (entry.isFile) {
      const file = await new Promise((resolve, reject) => entry.file(resolve, reject));
      files.push(Object.assign(file, { path: entry.fullPath }));
      return;
    }
    // A reader hands over some entries at a time, and none at the end.
    const reader = entry.createReader();
    for (;;) {
      const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
      if (!some.length) return;
      for (const one of some) await walk(one);
    }
  };
  for (const entry of [...transfer.items].map((item) => item.webkitGetAsEntry()).filter(Boolean)) await walk(entry);
  return files;
}
