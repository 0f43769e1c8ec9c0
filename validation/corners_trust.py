"""Can a corner's covariance be believed, and are wrong corners kept out? In photographs that are far from ideal.

Claim
    Whatever blur, noise, bit depth and size of squares: squared error over stated covariance is near 1. In photographs
    that a camera has sharpened, compressed, smoothed or put together from colours no corner is lost, errors stay within
    hundredths of a pixel, a third of cornerSubPix's or less, and are stated within a factor of two. Covered and
    reflecting corners are rejected, or their errors stated; hardly one off by more than 0.3 px is accepted.

Way
    Photographs by ``_corner_views.py``, starts 0.7 px off in random directions; the last but one table has squares of
    24 px, noise 3. JPEG is OpenCV's; sharpened by n: what a Gaussian blur of 1 px takes away is added n times; smoothed
    by a bilateral filter; colour: each pixel sees one of three and OpenCV fills in the others; enlarged from half the
    size. "In the way" and "reflections": 40 spots on a board of 378 corners, two photographs.

Run ``python validation/bench.py corners_trust``.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace

import cv2
import numpy as np
from _corner_subpix import by_subpix
from _corner_views import Case, photograph, rms, squared_over_stated

from opencsp_calib import Image
from opencsp_calib.rendering import Exposure, Scene, Spot

EXPOSURES = {
    "psf 0.3, noise 1": Case(exposure=Exposure(psf_px=0.3, noise=1.0)),
    "psf 0.6, noise 10": Case(exposure=Exposure(noise=10.0)),
    "psf 3": Case(exposure=Exposure(psf_px=3.0)),
    "defocus, disc of radius 4": Case(exposure=Exposure(psf_px=0.4, defocus_px=4.0)),
    "motion of 2 px": Case(exposure=Exposure(motion_px=(1.8, 0.9))),
    "16 bits, noise 0.5": Case(exposure=Exposure(noise=0.5, bits=16)),
    "squares of 8 px": Case(square_px=8.0),
    "squares of 8 px, psf 1": Case(square_px=8.0, exposure=Exposure(psf_px=1.0)),
    "squares of 16 px, psf 3": Case(square_px=16.0, exposure=Exposure(psf_px=3.0)),
    "squares of 24 px, psf 4": Case(square_px=24.0, exposure=Exposure(psf_px=4.0)),
    "tilt 60 degrees": Case(tilt_deg=60.0),
    "light from one side": Case(scene=Scene(shading=(1.3, -1.0))),
}

Grey = np.ndarray


def eight_bit(grey: Grey) -> Grey:
    """Rounded and clipped."""
    return np.clip(np.rint(grey), 0, 255).astype(np.uint8)


def compressed(grey: Grey, quality: int) -> Grey:
    """As JPEG has it."""
    file = cv2.imencode(".jpg", eight_bit(grey), [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    return cv2.imdecode(file, cv2.IMREAD_GRAYSCALE)


def sharpened(grey: Grey, amount: float) -> Grey:
    """What a blur takes away is added."""
    grey = grey.astype(np.float64)
    return np.clip(grey + amount * (grey - cv2.GaussianBlur(grey, (0, 0), 1.0)), 0, 255)


def coloured(grey: Grey) -> Grey:
    """Each pixel sees one colour; the others are filled in."""
    return cv2.cvtColor(cv2.demosaicing(eight_bit(grey), cv2.COLOR_BayerBG2BGR), cv2.COLOR_BGR2GRAY)


def smoothed(grey: Grey) -> Grey:
    """Where it is flat, as cameras hide noise."""
    return cv2.bilateralFilter(eight_bit(grey), 5, 20, 2)


def enlarged(grey: Grey) -> Grey:
    """From half the size."""
    half = cv2.resize(grey, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    return cv2.resize(half, grey.shape[::-1], interpolation=cv2.INTER_CUBIC)


PROCESSES: dict[str, Callable[[Grey], Grey]] = {
    "none": lambda grey: grey,
    "JPEG 95": lambda grey: compressed(grey, 95),
    "JPEG 75": lambda grey: compressed(grey, 75),
    "JPEG 50": lambda grey: compressed(grey, 50),
    "JPEG 25": lambda grey: compressed(grey, 25),
    "sharpened by 1": lambda grey: sharpened(grey, 1.0),
    "sharpened by 2": lambda grey: sharpened(grey, 2.0),
    "sharpened by 1, JPEG 75": lambda grey: compressed(sharpened(grey, 1.0), 75),
    "sharpened by 2, JPEG 50": lambda grey: compressed(sharpened(grey, 2.0), 50),
    "colour": coloured,
    "colour, sharpened by 1, JPEG 85": lambda grey: compressed(sharpened(coloured(grey), 1.0), 85),
    "gamma 2.2": lambda grey: 255 * (grey / 255.0) ** (1 / 2.2),
    "tone curve": lambda grey: 255 * ((grey / 255.0) ** 2 * (3 - 2 * (grey / 255.0))),
    "smoothed": smoothed,
    "smoothed, sharpened by 1.5, JPEG 80": lambda grey: compressed(sharpened(smoothed(grey), 1.5), 80),
    "median of 3x3": lambda grey: cv2.medianBlur(eight_bit(grey), 3),
    "enlarged": enlarged,
}


def honesty() -> Iterator[str]:
    """Three views each."""
    yield "| photograph | rejected | rms | stated | squared error / stated, each view |\n|---|---|---|---|---|"
    for name, case in EXPOSURES.items():
        square, stated, ratios, rejected = [], [], [], 0
        for seed in range(3):
            view = photograph(replace(case, seed=seed))
            refined = view.refined()
            off = view.errors(refined)
            square.append(np.mean(off**2))
            stated.append(np.trace(refined.covariance, axis1=1, axis2=2).mean() / 2)
            ratios.append(float(squared_over_stated(off, refined.covariance).mean()))
            rejected += len(refined.rejected)
        told = " ".join(f"{ratio:.2f}" for ratio in ratios)
        yield f"| {name} | {rejected} | {np.sqrt(np.mean(square)):.4f} | {np.sqrt(np.mean(stated)):.4f} | {told} |"


def processed() -> Iterator[str]:
    """One photograph, as different cameras would have made it."""
    view = photograph(Case(square_px=24.0, exposure=Exposure(noise=3.0)))
    yield "| made | rejected | rms | cornerSubPix 5 | squared error / stated | worst px |\n|---|---|---|---|---|---|"
    for name, process in PROCESSES.items():
        made = replace(view, image=Image(name, eight_bit(process(view.image.pixels))))
        refined = made.refined()
        off = made.errors(refined)
        by_opencv = by_subpix(made.image.pixels, made.start, 5) - made.truth
        ratio = squared_over_stated(off, refined.covariance).mean()
        worst = np.linalg.norm(off, axis=1).max()
        rejected = f"{len(refined.rejected)} of {len(view.truth)}"
        yield f"| {name} | {rejected} | {rms(off):.4f} | {rms(by_opencv):.4f} | {ratio:.2f} | {worst:.3f} |"


def disturbances() -> Iterator[str]:
    """Things in the way, and reflections."""
    yield "| spots | accepted | off by more than 0.1, 0.3, 1 px | squared error / stated |\n|---|---|---|---|"
    for kind, levels in (("occluders", (22.0, 90.0, 190.0, 250.0)), ("glare", (40.0, 100.0, 250.0))):
        for level in levels:
            for radius in (3.0, 8.0, 20.0):
                yield disturbed(kind, level, radius)


def disturbed(kind: str, level: float, radius: float) -> str:
    """A row."""
    accepted, ratios, distances = [], [], []
    for seed in range(2):
        case = Case(seed=seed)
        truth = photograph(case).truth
        rng = np.random.default_rng(seed)
        places = truth[rng.choice(len(truth), 40, replace=False)] + rng.normal(0, radius, (40, 2))
        spots = tuple(Spot(x, y, radius, level) for x, y in places)
        view = photograph(replace(case, scene=Scene(**{kind: spots})))
        refined = view.refined()
        off = view.errors(refined)
        accepted.append(len(refined))
        ratios.append(squared_over_stated(off, refined.covariance))
        distances.append(np.linalg.norm(off, axis=1))
    distance = np.concatenate(distances)
    beyond = ", ".join(str(int((distance > limit).sum())) for limit in (0.1, 0.3, 1.0))
    what = "in the way" if kind == "occluders" else "reflections"
    numbers = f"{np.mean(accepted):.0f} | {beyond} | {np.concatenate(ratios).mean():.2f}"
    return f"| {what}, level {level:.0f}, radius {radius:.0f} px | {numbers} |"


def main() -> None:
    """Print the tables."""
    for title, rows in (
        ("Exposures", honesty),
        ("Photographs that a camera has processed", processed),
        ("Things in the way, and reflections", disturbances),
    ):
        print(f"\n### {title}\n")
        print(*rows(), sep="\n", flush=True)


if __name__ == "__main__":
    main()
