// SPDX-License-Identifier: Apache-2.0
// Moves the place of a headset in the world as hands ask: hold and pull the world, walk with a stick, turn, go where
// they point. Knows no headset and no clock.
#pragma once

#include "player/present/headset/headset.h"
#include "player/poses/placement.h"

namespace gsc {

class Hands {
public:
    // `start`: where the menu button brings the viewer back to. `floor`: its height in the space, metres.
    Hands(const Placement& start, double floor) : m_start(start), m_floor(floor) {}

    // One step of `seconds`, from what hands do now; `head` is between the eyes. Returns whether the place changed.
    //   grab     one hand holds the world and pulls it along; two turn it about the vertical and scale it
    //   stick    left: walks, level, where the head looks; right: turns by 30 degrees at a time, and up and down
    //   teleport held: nothing; let go: the head comes to stand above the point of the floor that the hand aims at
    //   menu     back to the start
    bool step(Placement& placement, const HeadsetInput& input, const SpacePose& head, double seconds);

    void letGo() // of what hands hold: they are somewhere else at once
    {
        for (Hand& hand : m_hands)
            hand.held.reset();
    }

private:
    struct Hand {
        std::optional<SpacePose> held; // the grip of the step before, while it grabs
        bool teleports = false, menu = false;
    };

    bool grab(Placement& placement, const HeadsetInput& input);
    bool walk(Placement& placement, const HeadsetInput& input, const SpacePose& head, double seconds);
    bool teleport(Placement& placement, const HeadsetInput& input, const SpacePose& head);

    Placement m_start;
    double m_floor;
    Hand m_hands[2];
    bool m_turned = false; // the stick has not been let go since
};

} // namespace gsc
