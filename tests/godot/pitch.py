"""pitch.py MODE HEARD: measures frequencies in what a game heard, at 48 kHz.

`doppler`: a tone of 440 Hz comes nearer at 5 m/s for 0.6 s and goes away again, while the game's frames and the
library's keyframes do not coincide; `doppler_ears`: its listener does so. `retuned`: a tone of 440 Hz in noise becomes one of 660 Hz, at the same level and
with the room's reverberation.
"""
import sys

import numpy as np

mode, heard_path = sys.argv[1:]
RATE = 48000
heard = np.fromfile(heard_path, np.float32).astype(float).reshape(-1, 2)[:, 0]
heard = heard[np.flatnonzero(np.abs(heard) > 1e-4)[0]:]


def part(from_s, to_s):
    return heard[int(from_s * RATE):int(to_s * RATE)]


def spectrum(samples):
    power = np.abs(np.fft.rfft(samples * np.hanning(len(samples)))) ** 2
    return np.fft.rfftfreq(len(samples), 1 / RATE), power / len(samples) ** 2


def level_db(samples, low_hz, high_hz):
    hertz, power = spectrum(samples)
    return 10 * np.log10(np.sum(power[(hertz >= low_hz) & (hertz < high_hz)]))


def is_near(what, value, wanted, within):
    print(f"{mode}: {what} {value:.2f}, wanted {wanted:.2f} within {within:.2f}")
    return abs(value - wanted) <= within


def frequency_hz(from_s, to_s):
    """The mean frequency, and how much it varies, of the tone within a band of 200 Hz."""
    whole = np.fft.fft(heard)
    hertz = np.fft.fftfreq(len(heard), 1 / RATE)
    tone = np.fft.ifft(np.where((hertz > 340) & (hertz < 540), whole, 0))
    phase = np.unwrap(np.angle(tone))[int(from_s * RATE):int(to_s * RATE)]
    seconds = np.arange(len(phase)) / RATE
    slope, offset = np.polyfit(seconds, phase, 1)
    return slope / (2 * np.pi), np.std(phase - slope * seconds - offset)


ok = True
if mode.startswith("doppler"):
    SOUND_MPS, SPEED_MPS = 343.2, 5
    for what, from_s, speed in [("nearer", 0.25, SPEED_MPS), ("away", 0.8, -SPEED_MPS)]:
        hertz, radians = frequency_hz(from_s, from_s + 0.35)
        wanted = 440 * (1 + speed / SOUND_MPS) if mode == "doppler_ears" else 440 / (1 - speed / SOUND_MPS)
        ok &= is_near(f"{what}: Hz", hertz, wanted, 0.01 * abs(wanted - 440))
        ok &= is_near(f"{what}: rms of the phase's error in radians", radians, 0, 0.02)
elif mode == "retuned":
    before, after, tail = part(0.3, 0.9), part(1.3, 1.9), part(2.4, 2.55)
    for what, samples, tone in [("before", before, 440), ("after", after, 660), ("dying away", tail, 660)]:
        hertz, power = spectrum(samples)
        near = (hertz > 300) & (hertz < 900)
        ok &= is_near(f"{what}: Hz", hertz[near][np.argmax(power[near])], tone, 3)
    for octave in (1000, 2000, 4000):
        low, high = octave / np.sqrt(2), octave * np.sqrt(2)
        # The noise fills a band that is one and a half times as wide.
        change_db = level_db(after, low, high) - level_db(before, low, high)
        ok &= is_near(f"{octave} Hz octave, dB", change_db, -10 * np.log10(1.5), 1.5)
        left_db = level_db(tail, low, high) - level_db(after, low, high)
        ok &= is_near(f"{octave} Hz octave, dB that are left after 0.4 s", left_db, -20, 10)
sys.exit(not ok)
