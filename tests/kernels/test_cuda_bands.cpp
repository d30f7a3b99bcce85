// SPDX-License-Identifier: Apache-2.0
// Bands of an image on the device: each decodes what the CPU would.
#include "tests/kernels/band_tools.h"
#include "tests/kernels/gpu_tools.h"

#include <doctest/doctest.h>

using namespace gsc;
using namespace gsc::test;

TEST_CASE("bands of an image: a band decodes what it can show, and CPU and device agree on what that is")
{
    const SyntheticModel model(bandScene(RasterRules::DiffGaussian, -4.5f, 6000));
    Renderer& gpu = cudaRenderer();
    gpu.load(model.view());
    const std::vector<EyeParams> eyes = {eyeAt(0.4f, -5, 256, 256)};
    const std::vector<double> shares = checkBands(gpu, eyes, onGrey(Tier::Fast), {128});
    CAPTURE(shares[0]);
    for (const double share : shares)
        CHECK(share < 0.65);
    CHECK(shares[0] + shares[1] >= 0.99);
    // the device's boxes are coarser, and hold all that the CPU's do
    const auto cpu = open(model.view(), "cpu", 1);
    FrameOptions band = onGrey(Tier::Fast);
    band.columns = {128, 256};
    CHECK(render(gpu, eyes, band)[0].result.eyes[0].anchors_visible >=
          render(*cpu, eyes, band)[0].result.eyes[0].anchors_visible);
}
