// SPDX-License-Identifier: Apache-2.0
// Moves a headset's viewer through the world by the controllers: pull the world, walk, turn, or teleport to where a
// hand points. Needs no headset and no clock.
#pragma once

#include "player/present/headset/headset.h"
#include "player/poses/placement.h"

namespace gsc {

class Hands {
public:
    // `start` is the placement that the menu button returns to, `floor` the height of the floor in the space, metres.
    Hands(const Placement& start, double floor) : m_start(start), m_floor(floor) {}

    // Takes one step of `seconds`. `input` is the state of the controllers, `head` the pose between the eyes. Returns
    // true if `placement` changed.
    //   grab     one hand holds the world and pulls it along; two turn it about the vertical and scale it
    //   stick    left: walks, level, where the head looks; right: turns by 30 degrees at a time, and moves up and down
    //   teleport on release the head comes to stand above the point of the floor that the hand aims at
    //   menu     back to the start
    bool step(Placement& placement, const HeadsetInput& input, const SpacePose& head, double seconds);

    void letGo() // forgets what the hands hold: call it when the viewer is suddenly elsewhere
    {
        for (Hand& hand : m_hands)
            hand.held.reset();
    }

private:
    struct Hand {
        std::optional<SpacePose> held; // pose of the hand's grip in the last step, if the hand grabbed; else none
        bool teleports = false, menu = false;
    };

    bool grab(Placement& placement, const HeadsetInput& input);
    bool walk(Placement& placement, const HeadsetInput& input, const SpacePose& head, double seconds);
    bool teleport(Placement& placement, const HeadsetInput& input, const SpacePose& head);

    Placement m_start;
    double m_floor;
    Hand m_hands[2];
    bool m_turned = false; // the stick has turned the viewer once and has not been back at rest since
};

} // namespace gsc
