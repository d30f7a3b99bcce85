// SPDX-License-Identifier: Apache-2.0
// Decisions of --reuse, pinned at their boundaries.
#include "kernels/reuse/policy.h"
#include "kernels/reuse/depth.h"

#include <doctest/doctest.h>

#include <cmath>
#include <initializer_list>

using namespace gsc;

namespace {

const float kNaN = std::nanf("");

ReuseRule ruleOf(float bound, const EyeMotion& motion = {}, uint64_t budget = 0)
{
    ReuseOptions reuse;
    reuse.policy = ReusePolicy::Error;
    reuse.bound = bound;
    reuse.decode_budget = budget;
    const EyeMotion eyes[kMaxEyes] = {motion, motion};
    return reuseRule(reuse, eyes);
}

EyeMotion moving(float x, float step)
{
    EyeMotion motion;
    motion.center[0] = x;
    motion.step[0] = step;
    motion.steady = true;
    return motion;
}

// Keys on the x axis.
StripKeys keysBetween(float x0, float x1, float span)
{
    const float center[3] = {x0, 0, 0};
    StripKeys keys = keysAt(center, 0xffff, false);
    keys.center[1][0] = x1;
    keys.count = 2;
    keys.span = span;
    return keys;
}

// A change of one per unit of way: what a plane far ahead sees.
float way(const float* c0, const float* c1)
{
    return std::abs(c1[0] - c0[0]);
}

// The strip of the first hundred that is spread the least or the most.
uint32_t stripOf(bool most)
{
    uint32_t best = 0;
    for (uint32_t s = 1; s < 100; ++s)
        if ((stagger(s) > stagger(best)) == most)
            best = s;
    return best;
}

} // namespace

TEST_CASE("a bound is in 1/255, and a camera that rests may draw all of it and no more")
{
    CHECK(ruleOf(255).bound == 1);
    CHECK(ruleOf(1).bound == doctest::Approx(1 / 255.0).epsilon(1e-6));
    const StripKeys keys = keysBetween(0, 1, 0);
    for (uint32_t strip = 0; strip < 50; ++strip)
        CHECK(allowedChange(ruleOf(2), 0, strip, keys) == 2.0f / 255.0f);
    CHECK(allowedChange(ruleOf(0), 1, 3, keys) == 0);
}

TEST_CASE("a camera on its way may draw at most the bound, spread by strip")
{
    const float center[3] = {};
    const StripKeys fresh = keysAt(center, 1, true), later = keysAt(center, 1, false), two = keysBetween(0, 1, 0);
    const uint32_t low = stripOf(false), high = stripOf(true);
    CHECK(stagger(0) == 0.3f);
    CHECK(stagger(low) < 0.32f);
    CHECK(stagger(high) > 0.98f);
    CHECK(stagger(high) < 1);
    const ReuseRule rule = ruleOf(255, moving(0, 1));
    for (const uint32_t strip : {low, high}) {
        const double spread = double(stagger(strip));
        CHECK(allowedChange(rule, 0, strip, fresh) == doctest::Approx(spread));
        CHECK(allowedChange(rule, 0, strip, later) == doctest::Approx(0.85 + 0.15 * spread));
        CHECK(allowedChange(rule, 0, strip, two) == doctest::Approx(0.85 + 0.15 * spread));
    }
    for (uint32_t strip = 0; strip < 1000; ++strip)
        for (const StripKeys& keys : {fresh, later, two})
            CHECK(allowedChange(rule, 0, strip, keys) <= 1);
    // and what is broad its share of that
    CHECK(allowedChange(ruleOf(255), 0, 0, two, kBroad) == 1);
    CHECK(allowedChange(ruleOf(255), 0, 0, two, 4 * kBroad) == doctest::Approx(0.5));
}

TEST_CASE("an entry is drawn at the place of its keys' line next to the camera, off by the rest and the curve")
{
    const StripKeys keys = keysBetween(1, 3, 0.5f);
    const auto at = [&](float x) {
        const float camera[3] = {x, 0, 0};
        return changeOf(keys, camera, way);
    };
    for (const float end : {1.0f, 3.0f}) { // keys are exact
        CHECK(at(end).t == (end - 1) / 2);
        CHECK(at(end).error == 0);
    }
    CHECK(at(2).t == 0.5f);
    CHECK(at(2).error == kCurve * 0.5f); // all of it in the middle
    CHECK(at(4).error == 4 * kCurve * 0.75f * 0.5f);
    CHECK(at(6).t == kMostMix);
    CHECK(at(6).error == doctest::Approx(2 + 4 * double(kCurve) * 0.75 * 0.5));
    CHECK(at(-2).t == kLeastMix);
    CHECK(at(-2).error == doctest::Approx(2 + 4 * double(kCurve) * 0.75 * 0.5));
    const float here[3] = {7, 0, 0}, there[3] = {7.5f, 0, 0};
    const StripKeys single = keysAt(here, 1, true);
    CHECK(changeOf(single, here, way).error == 0);
    CHECK(changeOf(single, there, way).t == 0);
    CHECK(changeOf(single, there, way).error == 0.5f);
    StripKeys same = keysBetween(2, 2, 0.5f); // a way of no length
    CHECK(changeOf(same, here, way).t == 0);
}

TEST_CASE("what a look tells is never below what the anchors say")
{
    StripKeys keys = keysBetween(0, 0.5f, 0.1f);
    const Vec3<float> p = {0.5f, 0, 4};
    keys.reach = {0.3f / 4, 4, 0.3f};
    const auto change = [&](const float* c0, const float* c1) { return predictedChange(p, c0, c1, 0.2f, 0.1f); };
    for (float x = -1; x < 2; x += 0.01f) {
        const float camera[3] = {x, 0.3f * x, 0};
        CHECK(changeAtMost(keys, camera).error >= changeOf(keys, camera, change).error);
        CHECK(changeAtMost(keys, camera).t == changeOf(keys, camera, change).t);
    }
    keys.reach = {}; // nothing is known
    CHECK(std::isinf(changeAtMost(keys, keys.center[0]).error));
}

TEST_CASE("a camera that does not move has an outlook of no change, and one that does gets nearer to a key ahead")
{
    const StripKeys kept = keysBetween(0, 4, 0);
    const Outlook rests = outlookOf(ruleOf(1, moving(2, 0)), 0, kept, way);
    CHECK(rests.rate == 0);
    CHECK(rests.urgency == 0);
    const float behind[3] = {1, 0, 0};
    const Outlook goes = outlookOf(ruleOf(1, moving(2, 0.25f)), 1, keysAt(behind, 1, false), way);
    CHECK(goes.rate == 0.25f);
    CHECK(goes.urgency == 1.25f);
    const float ahead[3] = {3, 0, 0};
    CHECK(outlookOf(ruleOf(1, moving(2, 0.25f)), 1, keysAt(ahead, 1, false), way).urgency == 0.75f);
}

TEST_CASE("a place ahead is as far as its lead, not nearer than asked for and not beyond what is foreseen")
{
    const EyeMotion motion = moving(1, 0.25f);
    float center[3] = {9, 9, 9};
    CHECK(placeAhead(motion, 0.25f, 0.5f, 1, way, center));
    CHECK(center[0] == 1.5f);
    CHECK(center[1] == 0);
    CHECK(placeAhead(motion, 0.25f, 0.25f, 1, way, center)); // one frame, and no less
    CHECK(center[0] == 1.25f);
    center[0] = 9;
    CHECK_FALSE(placeAhead(motion, 0.25f, 0.24f, 1, way, center));
    CHECK(center[0] == 9);
    CHECK(placeAhead(motion, 0.25f, 100, 1, way, center));
    CHECK(center[0] == 1 + kMaxLeadFrames * 0.25f);
    // a change that grows faster than its rate says: the second attempt is nearer
    const auto doubled = [](const float* c0, const float* c1) { return 2 * way(c0, c1); };
    CHECK(placeAhead(motion, 0.25f, 0.5f, 0.5f, doubled, center));
    CHECK(center[0] == doctest::Approx(1 + 0.45 * 0.5));
    center[0] = 9;
    CHECK_FALSE(placeAhead(motion, 0.25f, 0.5f, 1, doubled, center));
    // from a place on an anchor nothing can be told
    CHECK_FALSE(placeAhead(
        motion, INFINITY, 0.5f, 0.5f, [](const float*, const float*) { return INFINITY; }, center));
    CHECK(center[0] == 9);
}

TEST_CASE("entries span what the curve leaves of the bound, or live as long as the budget has them live")
{
    CHECK(spanAhead(0.07f, 0) == doctest::Approx(0.9));
    CHECK(spanAhead(0.07f, 2) == 2);
    CHECK(spanAhead(0, 0) == 0);
    CHECK(halfLife(1, 0) == kLeadShare);
    CHECK(halfLife(1, 4) == 2);
}

TEST_CASE("an entry is young enough for as many frames as the depth says after the one that decoded it")
{
    for (const uint64_t decoded : {uint64_t(1), uint64_t(1) << 40}) {
        CHECK(youngEnough(decoded, decoded, 0));
        CHECK_FALSE(youngEnough(decoded + 1, decoded, 0));
        CHECK(youngEnough(decoded + 3, decoded, 3));
        CHECK_FALSE(youngEnough(decoded + 4, decoded, 3));
    }
}

TEST_CASE("a budget holds back what is kept and not grossly wrong, and is of the error policy alone")
{
    const ReuseRule none = ruleOf(1), some = ruleOf(1, {}, 100);
    CHECK(mustDecode(none, true, 0));
    CHECK(mustDecode(some, false, 0));
    CHECK_FALSE(mustDecode(some, true, kGross));
    CHECK(mustDecode(some, true, std::nextafter(kGross, 1.0f)));
    CHECK(mustDecode(some, true, kNaN));
    ReuseOptions depth;
    depth.policy = ReusePolicy::Depth;
    depth.decode_budget = 100;
    CHECK(reuseRule(depth, some.eye).decode_budget == 0);
    CHECK(budgetLevel(some, 100, 7) == 0); // met
    CHECK(budgetLevel(some, 101, 7) == 0.07f);
    CHECK(budgetLevel(none, 101, 7) == 0);
}

TEST_CASE("the more urgent comes first: 256 buckets an octave, then an order of the frame's own")
{
    CHECK(urgencyBucket(0) == kUrgencies - 1);
    CHECK(urgencyBucket(-1) == kUrgencies - 1);
    CHECK(urgencyBucket(kNaN) == kUrgencies - 1);
    CHECK(urgencyBucket(0x1p-16f) == kUrgencies - 1);
    CHECK(urgencyBucket(0x1.01p-16f) == kUrgencies - 2);
    CHECK(urgencyBucket(0.5f) == kUrgencies - 1 - 15 * 256);
    CHECK(urgencyBucket(1) == 0);
    CHECK(urgencyBucket(INFINITY) == 0);
    uint32_t before = kUrgencies;
    for (float urgency = 0x1p-17f; urgency < 2; urgency *= 1.5f) {
        CHECK(urgencyBucket(urgency) <= before);
        before = urgencyBucket(urgency);
    }
    uint32_t swapped = 0;
    for (uint32_t strip = 0; strip < 1000; ++strip) {
        CHECK(splitOf(strip, 1) < kSplits);
        swapped += (splitOf(strip, 1) < splitOf(strip + 1, 1)) != (splitOf(strip, 2) < splitOf(strip + 1, 2));
    }
    CHECK(swapped > 300);
    CHECK(swapped < 700);
}
