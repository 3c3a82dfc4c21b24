(function () {
  var said = document.getElementById("said");
  function choose(mark) {
    var drawing = mark.closest("svg.ids");
    document.querySelectorAll(".ids .same,.ids .now").forEach(function (x) { x.classList.remove("same", "now"); });
    document.querySelectorAll(".ids.chosen").forEach(function (x) { x.classList.remove("chosen"); });
    drawing.classList.add("chosen");
    mark.classList.add("now");
    [mark.dataset.said, mark.dataset.before].forEach(function (id) {
      if (id === undefined) { return; }
      drawing.querySelectorAll('.by[data-said="' + id + '"]').forEach(function (x) { x.classList.add("same"); });
    });
    said.textContent = mark.dataset.told;
  }
  document.addEventListener("click", function (e) {
    var mark = e.target.closest(".ids [data-told]");
    if (mark) { choose(mark); }
  });
  document.addEventListener("keydown", function (e) {
    var mark = e.target.closest && e.target.closest(".ids [data-told]");
    if (mark && (e.key === "Enter" || e.key === " ")) { e.preventDefault(); choose(mark); }
  });
})();
