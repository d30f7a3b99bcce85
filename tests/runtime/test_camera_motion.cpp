// SPDX-License-Identifier: Apache-2.0
#include "runtime/view/camera_motion.h"

#include <doctest/doctest.h>

#include <cmath>
#include <initializer_list>

using namespace gsc;

namespace {

EyeParams eyeAtX(float x)
{
    EyeParams eye{};
    eye.center[0] = x;
    return eye;
}

struct Followed {
    CameraMotion motion;

    void to(float x)
    {
        const EyeParams eye = eyeAtX(x);
        motion.follow(&eye, 1);
    }
};

} // namespace

TEST_CASE("a camera that keeps its pace is steady, one that rests or goes to and fro is not")
{
    Followed camera;
    CameraMotion& motion = camera.motion;
    camera.to(1);
    CHECK_FALSE(motion.eyes()[0].steady);
    for (const float x : {1.1f, 1.2f, 1.3f, 1.35f}) { // the last step is half of those before
        camera.to(x);
        CHECK(motion.eyes()[0].steady == (x < 1.34f));
    }
    camera.to(1.35f);
    CHECK_FALSE(motion.eyes()[0].steady);
    for (const float x : {1.4f, 1.35f, 1.4f}) {
        camera.to(x);
        CHECK_FALSE(motion.eyes()[0].steady);
    }
}

TEST_CASE("steps are of the frame before, and start anew with an eye that was not there and a place that is no number")
{
    CameraMotion motion;
    const EyeParams eyes[2][2] = {{eyeAtX(1), eyeAtX(2)}, {eyeAtX(1.5f), eyeAtX(2.25f)}};
    motion.follow(eyes[0], 2);
    motion.follow(eyes[1], 2);
    CHECK(motion.eyes()[0].step[0] == 0.5f);
    CHECK(motion.eyes()[1].step[0] == 0.25f);
    motion.follow(eyes[0], 1); // the right eye closes
    CHECK_FALSE(motion.eyes()[1].steady);
    motion.follow(eyes[1], 2);
    CHECK(motion.eyes()[1].step[0] == 0.0f);

    const EyeParams nowhere = eyeAtX(std::nanf(""));
    motion.follow(&nowhere, 1);
    CHECK_FALSE(motion.eyes()[0].steady);
    motion.follow(eyes[0], 1);
    CHECK(motion.eyes()[0].step[0] == 0);
    CHECK_FALSE(motion.eyes()[0].steady);
    motion.forget();
    motion.follow(eyes[1], 1);
    CHECK(motion.eyes()[0].step[0] == 0);
    CHECK_FALSE(motion.eyes()[0].steady);
}
