// Shows that the page is stale when no new view has arrived for 1.5 s.
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
// A sign of life: without it the autopilot treats the operator as lost.
setInterval(() => window.emitEvent && emitEvent("helmHere"), 2000);
document.documentElement.lang = "en";
document.body.classList.add("stale");
setInterval(() => {
  if (Date.now() - helmLast > 1500) document.body.classList.add("stale");
}, 250);
// /login answers with a page only if this browser has to log in again; else it redirects.
setInterval(() => {
  if (!document.body.classList.contains("stale")) return;
  fetch("/login", { redirect: "manual" }).then((reply) => reply.ok && location.assign("/login")).catch(() => {});
}, 5000);
window.addEventListener("load", () => {
  const kept = localStorage.getItem("helmDark");
  if (kept !== null) setTimeout(() => Quasar.Dark.set(kept === "true"), 0);
});
