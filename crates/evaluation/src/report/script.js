"use strict";
document.querySelectorAll("table.sortable").forEach(function (table) {
  var body = table.tBodies[0];
  table.querySelectorAll("thead th").forEach(function (head, column) {
    head.tabIndex = 0;
    function sort() {
      var descending = head.getAttribute("aria-sort") ? head.getAttribute("aria-sort") === "ascending" : column > 0;
      table.querySelectorAll("thead th").forEach(function (h) { h.removeAttribute("aria-sort"); });
      head.setAttribute("aria-sort", descending ? "descending" : "ascending");
      var rows = Array.from(body.rows).filter(function (r) { return r.cells.length > 1; });
      rows.sort(function (a, b) {
        var x = a.cells[column], y = b.cells[column];
        if (x.dataset.v === undefined) {
          return (descending ? -1 : 1) * x.textContent.localeCompare(y.textContent, undefined, { numeric: true });
        }
        var p = x.dataset.v === "" ? NaN : +x.dataset.v, q = y.dataset.v === "" ? NaN : +y.dataset.v;
        if (isNaN(p) || isNaN(q)) { return isNaN(p) - isNaN(q); }
        return descending ? q - p : p - q;
      });
      rows.forEach(function (r) { body.appendChild(r); });
    }
    head.addEventListener("click", sort);
    head.addEventListener("keydown", function (e) { if (e.key === "Enter") { sort(); } });
  });
});
document.addEventListener("click", function (e) {
  var who = e.target.closest("button.who");
  if (!who) { return; }
  var off = !who.classList.contains("off");
  document.querySelectorAll('[data-t="' + who.dataset.t + '"]').forEach(function (x) { x.classList.toggle("off", off); });
});
function unfold() {
  var target = location.hash && document.getElementById(location.hash.slice(1));
  if (target && target.tagName === "DETAILS") { target.open = true; target.scrollIntoView(); }
}
addEventListener("hashchange", unfold);
unfold();
