// The player: the construction, step by step.

const STEP_MS = 420, LONGEST_PLAY_MS = 60000;
let timer = 0;

function openPlayer() {
    if (!sequence) return;
    byId("player").hidden = false;
    byId("step").max = nRods;
    byId("step").addEventListener("input", () => goTo(+byId("step").value));
    const targets = { first: () => 0, back: () => state.step - 1, next: () => state.step + 1, last: () => nRods };
    for (const [id, target] of Object.entries(targets)) byId(id).addEventListener("click", () => goTo(target()));
    byId("play").addEventListener("click", togglePlay);
    byId("track-colours").style.background = trackColours();
    watchers.push(showStep);
    showStep();
}

/** One band of colour a generation, as long as its steps. */
function trackColours() {
    const stops = [];
    let from = 0;
    for (let k = 1; k <= nRods; k++) {
        if (k < nRods && sequence.generation[k] === sequence.generation[from]) continue;
        const colour = cssColour(content.generationColours[Math.min(sequence.generation[from], nGenerations - 1)]);
        stops.push(`${colour} ${(100 * from) / nRods}% ${(100 * k) / nRods}%`);
        from = k;
    }
    return `linear-gradient(to right, ${stops.join(", ")})`;
}

/** Show the structure after so many steps. */
function goTo(step, isPlaying = false) {
    if (!sequence) return;
    if (!isPlaying) stopPlaying();
    const wanted = Math.min(Math.max(step, 0), nRods);
    const isGone = state.picked >= 0 && wanted < nRods && stepOfRod[state.picked] >= wanted;
    change(isGone ? { step: wanted, picked: -1, marked: -1 } : { step: wanted });
}

function togglePlay() {
    if (timer) return stopPlaying();
    if (isComplete()) goTo(0);
    if (state.picked >= 0) pick(-1);
    const every = Math.min(STEP_MS, LONGEST_PLAY_MS / nRods);
    timer = setInterval(() => {
        goTo(state.step + 1, true);
        if (isComplete()) stopPlaying();
    }, every);
    showPlaying();
}

function stopPlaying() {
    clearInterval(timer);
    timer = 0;
    showPlaying();
}

function showPlaying() {
    byId("play").classList.toggle("playing", timer !== 0);
    byId("play").setAttribute("aria-label", timer ? "Pause" : "Play");
    // A running text would be read out without an end.
    byId("step-text").setAttribute("aria-live", timer ? "off" : "polite");
}

function showStep() {
    byId("step").value = state.step;
    byId("step").setAttribute("aria-valuetext", stepText());
    byId("step-text").textContent = stepText();
    for (const id of ["first", "back"]) byId(id).disabled = state.step === 0;
    for (const id of ["next", "last"]) byId(id).disabled = isComplete();
}

function stepText() {
    if (isComplete()) return `Complete: ${nRods} rods, ${sequence.tied.length} joints tied`;
    if (state.step === 0) return `Nothing stands yet; ${nRods} rods to set`;
    const k = state.step - 1;
    const name = rods.names[sequence.rods[k]];
    const tied = sequence.tiedOffsets[k + 1] - sequence.tiedOffsets[k];
    const generation = sequence.generation[k];
    const action = !sequence.isRing[k] ? `weave in ${name}` : generation === 0 ? `set border ring ${name}` : `set ring ${name}`;
    const ties = tied === 0 ? "" : tied === 1 ? ", tie 1 joint" : `, tie ${tied} joints`;
    return `Step ${state.step} of ${nRods}: ${action}${ties}`;
}
