/** The files of the playback's buttons: a picture, and a film of the canvas while it plays. */

function save(blob, name) {
  const a = document.createElement("a");
  a.href = URL.createObjectURL(blob);
  a.download = name;
  a.click();
  setTimeout(() => URL.revokeObjectURL(a.href), 10000);
}

/** What stands on the page, at the time shown. */
export function picture(stage, name) {
  stage.draw();  // a canvas forgets its picture once it was shown
  stage.renderer.domElement.toBlob((blob) => blob && save(blob, `${name}.png`), "image/png");
}

const kinds = ["video/mp4;codecs=avc1", "video/webm;codecs=vp9", "video/webm"];

/** Whether this browser can write films. */
export const filmed = () => typeof MediaRecorder === "function" && kinds.some((k) => MediaRecorder.isTypeSupported(k));

/** Plays from the beginning to the end, at the speed that is chosen, and saves it. A second call ends the film early. onEnd: called once it is saved. */
export function film(stage, name, onEnd) {
  const kind = kinds.find((k) => MediaRecorder.isTypeSupported(k)), parts = [];
  const recorder = new MediaRecorder(stage.renderer.domElement.captureStream(30), { mimeType: kind, videoBitsPerSecond: 8e6 });
  recorder.ondataavailable = (e) => e.data.size && parts.push(e.data);
  recorder.onstop = () => {
    clearInterval(watch);
    stage.play(false);
    save(new Blob(parts, { type: kind.split(";")[0] }), `${name}.${kind.startsWith("video/mp4") ? "mp4" : "webm"}`);
    onEnd();
  };
  stage.seek(stage.first);
  recorder.start(1000);
  stage.play(true);
  const watch = setInterval(() => !stage.playing && recorder.state === "recording" && recorder.stop(), 100);
  return () => recorder.state === "recording" && recorder.stop();
}
