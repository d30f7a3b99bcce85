// SPDX-License-Identifier: Apache-2.0
#include "player/xr/hands.h"

#include <glm/geometric.hpp>

#include <cmath>
#include <numbers>

namespace gsc {

namespace {

// a hand grabs above the one share of the grip's travel and releases below the other, so that a trembling finger does
// neither
constexpr double kGrabs = 0.6, kLetsGo = 0.4;
constexpr double kStickDeadZone = 0.15; // a stick that is deflected less counts as at rest, share of full deflection
constexpr double kTurns = 0.7, kTurnsAgain = 0.3;
constexpr double kSnap = std::numbers::pi / 6;
constexpr double kWalks = 2.5;    // fastest walk by the stick, metres per second
constexpr double kPoints = 15;    // longest way of one teleport, metres
constexpr double kMostStep = 0.1; // longest step in seconds, so that a viewer who was away does not leap

double bent(double stick)
{
    const double size = std::abs(stick);
    if (!(size > kStickDeadZone))
        return 0;
    return std::copysign(std::min((size - kStickDeadZone) / (1 - kStickDeadZone), 1.0), stick);
}

} // namespace

bool Hands::step(Placement& placement, const HeadsetInput& input, const SpacePose& head, double seconds)
{
    bool back = false;
    for (int hand = 0; hand < 2; ++hand) {
        back = back || (input.hands[hand].menu && !m_hands[hand].menu);
        m_hands[hand].menu = input.hands[hand].menu;
    }
    if (back) {
        placement = m_start;
        for (Hand& hand : m_hands)
            hand.held.reset();
        return true;
    }
    const bool pulled = grab(placement, input);
    const bool walked = walk(placement, input, head, std::min(seconds, kMostStep));
    return teleport(placement, input, head) || walked || pulled;
}

bool Hands::grab(Placement& placement, const HeadsetInput& input)
{
    std::optional<SpacePose> now[2];
    bool both = true;
    for (int i = 0; i < 2; ++i) {
        const HandInput& hand = input.hands[i];
        if (hand.grip && hand.grab > (m_hands[i].held ? kLetsGo : kGrabs))
            now[i] = hand.grip;
        both = both && now[i] && m_hands[i].held;
    }
    bool moved = false;
    if (both) {
        const glm::dvec3 from[2] = {m_hands[0].held->position, m_hands[1].held->position};
        const glm::dvec3 to[2] = {now[0]->position, now[1]->position};
        placement.drag(from, to);
        moved = true;
    } else if (!now[0] || !now[1]) { // a second hand that has just grabbed: both hands act from the next step on
        for (int i = 0; i < 2; ++i)
            if (now[i] && m_hands[i].held) {
                placement.drag(m_hands[i].held->position, now[i]->position);
                moved = true;
            }
    }
    for (int i = 0; i < 2; ++i)
        m_hands[i].held = now[i];
    return moved;
}

bool Hands::walk(Placement& placement, const HeadsetInput& input, const SpacePose& head, double seconds)
{
    const double turns = input.hands[1].stick[0];
    bool moved = false;
    if (!m_turned && std::abs(turns) > kTurns) {
        placement.turn(std::copysign(kSnap, -turns), head.position); // a turn to the right is clockwise seen from above
        moved = m_turned = true;
    } else if (std::abs(turns) < kTurnsAgain) {
        m_turned = false;
    }
    const double right = bent(input.hands[0].stick[0]), ahead = bent(input.hands[0].stick[1]);
    const double up = std::abs(turns) < kTurnsAgain ? bent(input.hands[1].stick[1]) : 0;
    if (right == 0 && ahead == 0 && up == 0)
        return moved;
    glm::dvec3 forward = head.rotation * glm::dvec3(0, 0, -1);
    if (std::abs(forward.y) > 0.99) // the head looks almost straight up or down, so its forward axis gives no direction
        forward = head.rotation * glm::dvec3(0, forward.y > 0 ? -1 : 1, 0);
    forward.y = 0;
    forward = glm::normalize(forward);
    const glm::dvec3 sideways(-forward.z, 0, forward.x);
    placement.move((sideways * right + forward * ahead + glm::dvec3(0, up, 0)) * (kWalks * seconds));
    return true;
}

bool Hands::teleport(Placement& placement, const HeadsetInput& input, const SpacePose& head)
{
    bool moved = false;
    for (int i = 0; i < 2; ++i) {
        const HandInput& hand = input.hands[i];
        const bool let_go = m_hands[i].teleports && !hand.teleport;
        m_hands[i].teleports = hand.teleport;
        if (!let_go || !hand.aim)
            continue;
        if (const std::optional<glm::dvec3> to = pointOnFloor(*hand.aim, m_floor, kPoints)) {
            placement.move({to->x - head.position.x, 0, to->z - head.position.z});
            moved = true;
        }
    }
    return moved;
}

} // namespace gsc
