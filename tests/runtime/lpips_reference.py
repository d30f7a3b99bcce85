#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Computes LPIPS in PyTorch with weights that tests/support/lpips_random.h makes too. Writes lpips_reference.h beside
it and the heads, as PyTorch before 1.6 saved them, to tests/input/lpips_heads_legacy.pth. Needs numpy and PyTorch; run
only to make those two files again.

usage: lpips_reference.py
"""
import math
import pathlib
from collections import OrderedDict

import numpy
import torch

NET = [[(3, 64), (64, 64)], [(64, 128), (128, 128)], [(128, 256), (256, 256), (256, 256)],
       [(256, 512), (512, 512), (512, 512)], [(512, 512), (512, 512), (512, 512)]]
WIDTH, HEIGHT, SAMPLES = 53, 37, 12


def noise(stream: int, count: int) -> numpy.ndarray:
    x = numpy.arange(count, dtype=numpy.uint32) * numpy.uint32(2654435761)
    x = x + numpy.uint32(stream * 0x9E3779B9 & 0xFFFFFFFF)
    x = (x ^ x >> numpy.uint32(16)) * numpy.uint32(0x7FEB352D)
    x = (x ^ x >> numpy.uint32(15)) * numpy.uint32(0x846CA68B)
    x = x ^ x >> numpy.uint32(16)
    return (x >> numpy.uint32(8)).astype(numpy.float32) * numpy.float32(2.0 ** -23) - numpy.float32(1)


def picture(image: int) -> torch.Tensor:
    count, one = 3 * WIDTH * HEIGHT, numpy.float32(1)
    pixels = (noise(60, count) + one) * numpy.float32(0.5)
    if image == 1:
        pixels = pixels * numpy.float32(0.75) + (noise(61, count) + one) * numpy.float32(0.125)
    return torch.from_numpy(pixels.reshape(1, HEIGHT, WIDTH, 3)).permute(0, 3, 1, 2).contiguous()


def stages(image: torch.Tensor) -> list[torch.Tensor]:
    x = (image - torch.tensor([-0.030, -0.088, -0.188])[None, :, None, None]) / torch.tensor(
        [0.458, 0.448, 0.450])[None, :, None, None]
    number, outputs = 0, []
    for stage, layers in enumerate(NET):
        if stage:
            x = torch.nn.functional.max_pool2d(x, 2)
        for inputs, outs in layers:
            bound = numpy.float32(math.sqrt(6.0 / (9 * inputs)))
            weight = (noise(number, outs * inputs * 9) * bound).reshape(outs, inputs, 3, 3)
            bias = noise(20 + number, outs) * numpy.float32(0.1)
            x = torch.relu(torch.nn.functional.conv2d(x, torch.from_numpy(weight), torch.from_numpy(bias), padding=1))
            number += 1
        outputs.append(x)
    return outputs


def unit(x: torch.Tensor) -> torch.Tensor:
    return x / (torch.sqrt(torch.sum(x * x, dim=1, keepdim=True)) + 1e-10)


def main() -> None:
    here = pathlib.Path(__file__).resolve().parent
    heads = OrderedDict()
    for stage, layers in enumerate(NET):
        channels = layers[-1][1]
        head = (noise(40 + stage, channels) + numpy.float32(1)) * numpy.float32(0.5 / channels)
        heads[f"lin{stage}.model.1.weight"] = torch.from_numpy(head.reshape(1, channels, 1, 1))
    torch.save(heads, here.parent / "input/lpips_heads_legacy.pth", _use_new_zipfile_serialization=False)

    features = [stages(picture(image)) for image in (0, 1)]
    rows = []
    for stage, (a, b) in enumerate(zip(*features)):
        weighted = torch.nn.functional.conv2d((unit(a) - unit(b)) ** 2, heads[f"lin{stage}.model.1.weight"])
        distance = weighted.double().mean().item()
        means = [f"{x.double().mean().item():.9g}" for x in (a, b)]
        count = a.numel()
        samples = []
        for i in range(SAMPLES):  # of picture 1, spread over everything, in the order channel, row, column
            at = (i * 7919 + 13) * 104729 % count
            while b.flatten()[at] == 0:  # what is rectified says little
                at = (at + 1) % count
            channel, rest = divmod(at, a.shape[2] * a.shape[3])
            y, x = divmod(rest, a.shape[3])
            samples.append(f"{{{channel}, {y}, {x}, {b[0, channel, y, x].item():.9g}f}}")
        rows.append(f"    {{{a.shape[3]},\n     {a.shape[2]},\n     {{{means[0]}, {means[1]}}},\n"
                    f"     {distance:.9g},\n     {{{{" + ",\n       ".join(samples) + "}}},")
    (here / "lpips_reference.h").write_text(f"""// SPDX-License-Identifier: Apache-2.0
// Written by lpips_reference.py.
#pragma once

#include <array>
#include <cstdint>

namespace gsc::test {{

constexpr uint32_t kLpipsReferenceWidth = {WIDTH}, kLpipsReferenceHeight = {HEIGHT};

struct LpipsReference {{
    struct Sample {{
        uint32_t channel, y, x;
        float value; // of picture 1
    }};
    uint32_t width, height;
    double mean[2]; // of each picture's features
    double distance;
    std::array<Sample, {SAMPLES}> samples;
}};

// clang-format off
constexpr LpipsReference kLpipsReference[] = {{
""" + "\n".join(rows) + """
};
// clang-format on

} // namespace gsc::test
""")


if __name__ == "__main__":
    main()
