// SPDX-License-Identifier: Apache-2.0
// Accuracy where an eye looks and around that, against values worked out by hand.
#include "player/measure/scorer.h"
#include "runtime/records/run_row.h"

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

using namespace gsc;

namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

// 3 x 1 pixels a quarter apart at depth 1: the middle one is on the axis, the others 14 degrees away.
EyeGaze lookingAt(float x = 0, float y = 0)
{
    EyeGaze gaze;
    gaze.eye.width = 3;
    gaze.eye.height = 1;
    gaze.eye.focal_x = gaze.eye.focal_y = 4;
    gaze.x = x;
    gaze.y = y;
    return gaze;
}

std::vector<bool> within(const EyeGaze& gaze)
{
    return {inFovea(gaze, 0, 0), inFovea(gaze, 1, 0), inFovea(gaze, 2, 0)};
}

// 3 x 1 grey pixels.
struct Row {
    Row(float a, float b, float c) : pixels{a, a, a, b, b, b, c, c, c} {}
    [[nodiscard]] PictureRef view() const { return {pixels.data(), 3, 1}; }
    std::vector<float> pixels;
};

// Both sides of a picture's fovea; `map` has what FLIP makes of each pixel, none where it was not asked for.
void addTo(FoveaScorer& scorer, uint64_t frame, const Row& image, const Row& exact, const EyeGaze& gaze,
           const std::vector<double>& map = {})
{
    PictureScores scores = makeHostScorer()->score(0, image.view(), exact.view(), {false, false, &gaze});
    for (uint32_t x = 0; x < map.size(); ++x) {
        std::optional<double>& sum = scores.fovea[inFovea(gaze, x, 0) ? 0 : 1].flip;
        sum = sum.value_or(0) + map[x];
    }
    scorer.add(frame, scores.fovea);
}

double decibelsOfMse(double mse)
{
    return -10 * std::log10(mse);
}

} // namespace

TEST_CASE("fovea: up to 12 degrees from the gaze, wherever that is")
{
    CHECK(within(lookingAt()) == std::vector<bool>{false, true, false});
    CHECK(within(lookingAt(0.25f)) == std::vector<bool>{false, false, true});
    CHECK(within(lookingAt(-0.125f)) == std::vector<bool>{true, true, false}); // 7 degrees from both
    CHECK(within(lookingAt(0, 0.25f)) == std::vector<bool>{false, false, false});
    EyeGaze aside = lookingAt(); // the axis is in the picture's first pixel
    aside.eye.tan_mid_x = 0.25f;
    CHECK(within(aside) == std::vector<bool>{true, false, false});
    // the border: tan 12 degrees is 0.21256
    EyeGaze edge = lookingAt();
    edge.eye.focal_x = float(1 / 0.2125);
    CHECK(inFovea(edge, 2, 0));
    edge.eye.focal_x = float(1 / 0.2126);
    CHECK_FALSE(inFovea(edge, 2, 0));
}

TEST_CASE("fovea: pooled over pixels, the worst image, FLIP where it is known")
{
    FoveaScorer scorer;
    CHECK(scorer.empty());
    const Row exact(0.5f, 0.5f, 0.5f);
    const std::vector<double> map = {0.5f, 0.125f, 0.25f};
    addTo(scorer, 0, Row(0.7f, 0.51f, 0.6f), exact, lookingAt(), map);
    addTo(scorer, 1, Row(0.9f, 0.5f, 0.5f), exact, lookingAt());
    const FoveaAccuracy a = scorer.result();
    CHECK(a.inside.share == doctest::Approx(1.0 / 3));
    CHECK(a.outside.share == doctest::Approx(2.0 / 3));
    CHECK(a.inside.psnr_pooled == doctest::Approx(decibelsOfMse(0.0001 / 2)).epsilon(1e-5));
    CHECK(a.inside.psnr_min == doctest::Approx(40).epsilon(1e-5));
    CHECK(a.inside.psnr_min_frame == 0);
    CHECK(a.outside.psnr_pooled == doctest::Approx(decibelsOfMse((0.04 + 0.01 + 0.16) / 4)).epsilon(1e-5));
    CHECK(a.outside.psnr_min == doctest::Approx(decibelsOfMse(0.16 / 2)).epsilon(1e-5));
    CHECK(a.outside.psnr_min_frame == 1);
    CHECK(a.inside.flip == 0.125);
    CHECK(a.outside.flip == 0.375);
    CHECK(foveaText(a) ==
          "within 12 degrees of the gaze: PSNR 43.01 dB pooled, 40.00 dB worst, FLIP 0.1250; around it: "
          "PSNR 12.80 dB pooled, 10.97 dB worst, FLIP 0.3750\n");
}

TEST_CASE("fovea: equal, not finite and no pixel at all; read back it is the same")
{
    const Row exact(0.5f, 0.5f, 0.5f);
    FoveaScorer broken;
    addTo(broken, 0, Row(kNaN, 0.5f, 0.5f), exact, lookingAt());
    OrderedJson json = toJson(broken.result());
    CHECK(json["inside"]["psnr"]["pooled"].is_null());
    CHECK(json["inside"]["flip_mean"].is_null());
    CHECK(json["outside"]["psnr"]["pooled"] == -999);
    CHECK(json["outside"]["psnr"]["min"] == -999);
    FoveaAccuracy again;
    describe(Record(json, "row"), again);
    CHECK(toJson(again) == json);
    CHECK(std::isinf(again.inside.psnr_min));
    CHECK(again.inside.flip == -1);

    FoveaScorer away;
    addTo(away, 0, exact, exact, lookingAt(0, 1));
    json = toJson(away.result());
    CHECK(json["inside"].is_null());
    CHECK(json["outside"]["share"] == 1);
    FoveaAccuracy nothing;
    describe(Record(json, "row"), nothing);
    CHECK(nothing.inside.share == 0);
    CHECK(foveaText(nothing) ==
          "within 12 degrees of the gaze: no pixel; around it: PSNR identical pooled, identical worst\n");
}

TEST_CASE("fovea: a run's accuracy has it with a gaze alone, and its parts make the whole")
{
    const Row exact(0.5f, 0.5f, 0.5f);
    Scorer with({{}, 0, 2}), without({{}, 0, 2});
    const EyeGaze gaze = lookingAt();
    for (uint64_t frame = 0; frame < 3; ++frame) { // FLIP in frames 0 and 2
        const Row image(0.6f + 0.1f * float(frame), 0.5f, 0.55f);
        with.add(frame, 0, image.view(), exact.view(), &gaze);
        without.add(frame, 0, image.view(), exact.view());
    }
    const Accuracy a = with.result();
    REQUIRE(a.fovea);
    CHECK(std::isinf(a.fovea->inside.psnr_pooled));
    CHECK(a.fovea->outside.psnr_pooled == doctest::Approx(a.psnr_pooled + decibelsOfMse(1.5)).epsilon(1e-5));
    CHECK(a.fovea->outside.psnr_min_frame == 2);
    CHECK(a.fovea->inside.flip / 3 + a.fovea->outside.flip * 2 / 3 == doctest::Approx(a.flip.mean).epsilon(1e-5));
    OrderedJson said = toJson(a), plain = toJson(without.result());
    CHECK_FALSE(plain.contains("fovea"));
    CHECK(said["fovea"]["inside"]["psnr"]["min"].is_null());
    Accuracy again;
    describe(Record(said, "row"), again);
    CHECK(toJson(again.fovea.value()) == said["fovea"]);
    said.erase("fovea");
    CHECK(said == plain); // nothing else has changed
}

TEST_CASE("fovea: what is no share is refused")
{
    const Row exact(0.5f, 0.5f, 0.5f);
    FoveaScorer scorer;
    addTo(scorer, 0, exact, exact, lookingAt());
    for (const double share : {0.0, 1.5, -1.0}) {
        OrderedJson json = toJson(scorer.result());
        json["inside"]["share"] = share;
        FoveaAccuracy read;
        CHECK_THROWS(describe(Record(json, "row"), read));
    }
}
