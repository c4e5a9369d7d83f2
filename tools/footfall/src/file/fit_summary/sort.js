
const table = document.querySelector("table.cards");
const heads = table ? [...table.tHead.rows[0].cells] : [];
heads.forEach((head, column) => {
  const button = document.createElement("button");
  button.type = "button";
  button.textContent = head.textContent;
  head.replaceChildren(button);
  const key = (row) => row.cells[column].dataset.sort;
  button.addEventListener("click", () => {
    const up = head.getAttribute("aria-sort") !== "ascending";
    heads.forEach((other) => other.removeAttribute("aria-sort"));
    head.setAttribute("aria-sort", up ? "ascending" : "descending");
    const compare = (a, b) => {
      const [x, y] = [key(a), key(b)];
      if (x === "" || y === "") return x === y ? 0 : x === "" ? 1 : -1;
      const apart = Number.isNaN(x - y) ? x.localeCompare(y) : x - y;
      return up ? apart : -apart;
    };
    table.tBodies[0].append(...[...table.tBodies[0].rows].sort(compare));
  });
});
