/** Pictures and films of the playback, with the time in a corner. */
import { ArrayBufferTarget, Muxer } from "mp4-muxer";

export function save(blob, name) {
  const a = document.createElement("a");
  a.href = URL.createObjectURL(blob);
  a.download = name;
  a.click();
  setTimeout(() => URL.revokeObjectURL(a.href), 10000);
}

/** A canvas with what the stage shows at this time; both sizes even, as video wants them. */
function shot(stage, canvas = document.createElement("canvas")) {
  stage.draw();  // a canvas forgets its picture once it was shown
  const from = stage.renderer.domElement, lines = stage.silent ? [] : (stage.host.querySelector(".said")?.innerText || "").split("\n");
  const width = from.width & ~1, height = from.height & ~1, size = Math.max(12, Math.round(height / 32));
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  const pen = canvas.getContext("2d");
  pen.drawImage(from, 0, 0);
  pen.font = `${size}px system-ui, sans-serif`;
  pen.fillStyle = getComputedStyle(stage.host.querySelector(".said") || document.body).color;
  lines.forEach((line, k) => pen.fillText(line, size, (1.8 + 1.4 * k) * size));
  return canvas;
}

/** Red, green and blue of each pixel as base64, rows from the top, with the moving bodies at these poses relative to an origin. */
export const pixels = (stage, poses, origin) => {
  stage.show(poses, origin);
  stage.draw();
  const canvas = document.createElement("canvas"), from = stage.renderer.domElement, { width, height } = from;
  Object.assign(canvas, { width, height });
  const pen = canvas.getContext("2d");
  pen.drawImage(from, 0, 0);
  const all = pen.getImageData(0, 0, width, height).data, rgb = new Uint8Array(3 * width * height);
  for (let i = 0, k = 0; i < all.length; i += 4) (rgb[k++] = all[i]), (rgb[k++] = all[i + 1]), (rgb[k++] = all[i + 2]);
  return base64(new Blob([rgb]));
};

/** A PNG file of what is shown. */
export const picture = (stage) => new Promise((done) => shot(stage).toBlob(done, "image/png"));

const codecs = [["avc1.640033", "avc"], ["avc1.640028", "avc"], ["vp09.00.51.08", "vp9"], ["vp09.00.31.08", "vp9"]];

/** The first codec that this browser can write, as the encoder's settings. */
async function settings(width, height, fps) {
  for (const [codec, name] of codecs) {
    const config = { codec, width, height, framerate: fps, bitrate: 8e6 * Math.max(1, (width * height) / (1280 * 720)) };
    if ((await VideoEncoder.isConfigSupported(config).catch(() => ({}))).supported) return { config, name };
  }
  throw new Error("this browser can write no video of this size");
}

/** Whether this browser can write films. */
export const filmed = () => typeof VideoEncoder === "function";

/**
 * An MP4 file of the playback from one time to another at `rate` seconds per second, picture by picture: smooth on any machine, however long one
 * picture takes. onFrame(done) is told the share and ends the film early by returning false.
 */
export async function film(stage, { from = stage.first, to = stage.last, rate = stage.rate, fps = 30, onFrame = () => true } = {}) {
  stage.play(false);
  stage.seek(from);
  const canvas = shot(stage), { config, name } = await settings(canvas.width, canvas.height, fps);
  const muxer = new Muxer({ target: new ArrayBufferTarget(), video: { codec: name, width: canvas.width, height: canvas.height, frameRate: fps }, fastStart: "in-memory" });
  let fault = null;
  const encoder = new VideoEncoder({ output: (chunk, meta) => muxer.addVideoChunk(chunk, meta), error: (e) => (fault = e) });
  encoder.configure(config);
  const frames = Math.max(2, Math.ceil(((to - from) / rate) * fps) + 1);
  for (let i = 0; i < frames && !fault; ++i) {
    stage.seek(from + ((to - from) * i) / (frames - 1));
    const frame = new VideoFrame(shot(stage, canvas), { timestamp: Math.round((1e6 * i) / fps), duration: Math.round(1e6 / fps) });
    encoder.encode(frame, { keyFrame: i % (4 * fps) === 0 });
    frame.close();
    while (encoder.encodeQueueSize > 4) await new Promise((next) => setTimeout(next, 1));
    if (i % 5 === 4) await new Promise((next) => setTimeout(next));  // the page stays alive
    if (!onFrame((i + 1) / frames)) break;
  }
  await encoder.flush().catch((e) => (fault = fault || e));
  if (fault) throw fault;
  muxer.finalize();
  return new Blob([muxer.target.buffer], { type: "video/mp4" });
}

/** A file's bytes as base64, for programs that steer the page. */
export const base64 = (blob) => new Promise((done, failed) => {
  const reader = new FileReader();
  reader.onload = () => done(reader.result.slice(reader.result.indexOf(",") + 1));
  reader.onerror = () => failed(reader.error);
  reader.readAsDataURL(blob);
});
