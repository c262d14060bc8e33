// Evaluated in the page of a report: what does it show?
(async () => {
  const wait = (ms) => new Promise((done) => setTimeout(done, ms));
  const name = (element) => `${element.tagName} ${element.id || element.alt || element.textContent}`.slice(0, 60);

  const scenes = [...document.querySelectorAll("[data-scene]")];
  const essential = [...scenes, ...document.querySelectorAll("h1, #ranking")];
  const hidden = essential.filter((element) => element.offsetHeight === 0).map(name);
  for (const scene of scenes)
    if (![...scene.querySelectorAll("svg.chart")].some((chart) => chart.getBoundingClientRect().height > 0))
      hidden.push(`chart of ${scene.dataset.scene}`);

  const broken = [];
  const pictures = [...document.querySelectorAll(".pair img")];
  for (const picture of pictures) {
    picture.loading = "eager";
    await picture.decode().catch(() => broken.push(name(picture)));
  }

  // Every button of a switch shows its own part, and no other.
  for (const group of document.querySelectorAll("[data-switch]")) {
    const key = group.dataset.switch;
    for (const button of group.querySelectorAll("button")) {
      button.click();
      for (const part of document.querySelectorAll(`[data-${key}]`))
        if (part.hidden === (part.dataset[key] === button.value)) broken.push(`${key} ${button.value}`);
    }
  }

  const video = document.querySelector("video");
  if (!video) return { scenes: [], hidden, broken: [...broken, "no video"] };
  await video.play();
  for (let tries = 0; video.currentTime === 0 && tries < 200; tries++) await wait(50);
  return {
    scenes: scenes.map((scene) => scene.dataset.scene),
    hidden,
    broken,
    pictures: pictures.length,
    video_width: video.videoWidth,
    video_secs: video.currentTime,
  };
})()
