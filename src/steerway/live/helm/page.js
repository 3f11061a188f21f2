// When a view came last, and what is to be done when none comes.
var helmSeq = -1;
var helmLast = 0;
function helmBeat(seq) {
  if (seq === helmSeq) return;
  helmSeq = seq;
  helmLast = Date.now();
  document.body.classList.remove("stale");
}
function helmShade() {
  const dark = !Quasar.Dark.isActive;
  Quasar.Dark.set(dark);
  localStorage.setItem("helmDark", dark);
}
document.body.classList.add("stale");
setInterval(() => {
  if (Date.now() - helmLast > 1500) document.body.classList.add("stale");
}, 250);
window.addEventListener("load", () => {
  const kept = localStorage.getItem("helmDark");
  if (kept !== null) setTimeout(() => Quasar.Dark.set(kept === "true"), 0);
});
