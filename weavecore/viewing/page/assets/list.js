// The list of rods: to find one by its name, and to pick it without a mouse.

const rows = [];
let order = [];

const SORTS = {
    name: { text: "Name", value: (rod) => rod, isFor: () => true },
    length: { text: "Longest", value: (rod) => -rods.length[rod], isFor: () => true },
    utilisation: { text: "Most bent", value: (rod) => -weave.utilisation[rod], isFor: () => weave },
    step: { text: "Construction", value: (rod) => stepOfRod[rod], isFor: () => sequence },
};

const byName = (() => {
    const collator = new Intl.Collator("en", { numeric: true });
    const places = [...rods.names.keys()].sort(
        (a, b) => rods.family[a] - rods.family[b] || collator.compare(rods.names[a], rods.names[b]),
    );
    return places;
})();

function fillList() {
    for (let rod = 0; rod < nRods; rod++) {
        const swatch = make("span", { class: "swatch" });
        const button = make("button", { type: "button", tabindex: -1, "data-rod": rod },
            swatch,
            make("span", { class: "row-name" }, rods.names[rod]),
            make("span", { class: "row-length" }, lengthText(rods.length[rod], 4)),
            weave ? useBar(weave.utilisation[rod]) : "");
        rows.push({ item: make("li", {}, button), button, swatch });
    }
    byId("rods-title").textContent = content.weave ? "Rods" : content.stage === "Surface" ? "Borders" : "Lines";
    byId("sort").append(...Object.entries(SORTS).filter(([, sort]) => sort.isFor()).map(([name, sort]) => make("option", { value: name }, sort.text)));
    byId("sort").addEventListener("change", sortList);
    byId("find").addEventListener("input", filterList);
    byId("find").addEventListener("keydown", (event) => {
        const first = listed()[0];
        if (event.key === "Enter" && first !== undefined) pick(first);
        if (event.key === "ArrowDown" && first !== undefined) rows[first].button.focus();
        if (["Enter", "ArrowDown"].includes(event.key)) event.preventDefault();
    });
    byId("list").addEventListener("click", (event) => {
        const button = event.target.closest("button");
        if (button) pick(+button.dataset.rod);
    });
    byId("list").addEventListener("keydown", moveInList);
    watchers.push(showInList);
    sortList();
    showInList({ colourBy: true });
}

/** How much of what its material bears a rod is bent, as a short bar. */
function useBar(utilisation) {
    const fill = make("span", { class: "use-fill" });
    fill.style.width = `${Math.min(100, 100 * utilisation)}%`;
    fill.style.background = cssColour(rampColour(content.utilisationColours, utilisation));
    return make("span", { class: "use", title: `Utilisation ${percentText(utilisation)}` }, fill);
}

function sortList() {
    const value = SORTS[byId("sort").value].value;
    order = byId("sort").value === "name" ? [...byName] : [...byName].sort((a, b) => value(a) - value(b));
    byId("list").replaceChildren(...order.map((rod) => rows[rod].item));
    setTabStop();
}

function filterList() {
    const wanted = byId("find").value.trim().toLowerCase();
    rods.names.forEach((name, rod) => (rows[rod].item.hidden = !name.toLowerCase().includes(wanted)));
    byId("none").hidden = listed().length > 0;
    setTabStop();
}

const listed = () => order.filter((rod) => !rows[rod].item.hidden);

/** The tab key comes to one row of the list; arrows go on from there. */
function setTabStop(wanted = state.picked) {
    const there = listed();
    const stop = there.includes(wanted) ? wanted : there[0];
    rows.forEach((row, rod) => (row.button.tabIndex = rod === stop ? 0 : -1));
}

function moveInList(event) {
    const there = listed();
    const at = there.indexOf(+event.target.dataset.rod);
    const to = { ArrowDown: at + 1, ArrowUp: at - 1, Home: 0, End: there.length - 1, PageDown: at + 10, PageUp: at - 10 }[event.key];
    if (to === undefined || at < 0) return;
    event.preventDefault();
    event.stopPropagation();
    const rod = there[Math.min(Math.max(to, 0), there.length - 1)];
    setTabStop(rod);
    rows[rod].button.focus();
}

function showInList(changes) {
    rows.forEach((row, rod) => {
        row.button.classList.toggle("away", !isShown(rod));
        if (rod === state.picked) row.button.setAttribute("aria-current", "true");
        else row.button.removeAttribute("aria-current");
        if ("colourBy" in changes) row.swatch.style.background = cssColour(litColour(colourOf(rod)));
    });
    if (!("picked" in changes) || state.picked < 0) return;
    setTabStop();
    const list = byId("list"), item = rows[state.picked].item;
    const above = item.offsetTop - list.offsetTop - list.scrollTop;
    if (above < 0 || above > list.clientHeight - item.offsetHeight) list.scrollTop += above - list.clientHeight / 3;
}

/** The rod so many places after the picked one in the list. */
function neighbourInList(by) {
    const there = listed();
    const at = there.indexOf(state.picked);
    return at < 0 ? there[by > 0 ? 0 : there.length - 1] : there[(at + by + there.length) % there.length];
}
