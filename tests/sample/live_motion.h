// SPDX-License-Identifier: Apache-2.0
// Checks that hold for `flight`, `stroll` and `look_around` beside every model: nobody's place, gaze or pace jumps.
#pragma once

#include "convert/survey/vec3.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace gsc::test {

// Poses at 90 a second.
class LiveMotion {
public:
    LiveMotion(const std::vector<dvec3>& position, const std::vector<dvec3>& forward, double metre)
        : m_position(position), m_forward(forward)
    {
        for (size_t i = 1; i < position.size(); ++i) {
            m_speed.push_back(length(position[i] - position[i - 1]) * 90 / metre);
            m_turn.push_back(angle(forward[i - 1], forward[i]) * 90);
        }
    }

    // Straight on at one speed, looking one way, for 2 to 20 seconds; 25 metres per second but where that is too short.
    void checkFlight() const
    {
        CHECK(m_position.size() >= 179);
        CHECK(m_position.size() <= 1800);
        CHECK(top(m_speed) < 25 + 1e-6);
        CHECK((top(m_speed) > 25 - 1e-6 || m_position.size() <= 181));
        CHECK(top(jumps(m_speed)) < 1e-6);
        CHECK(top(m_turn) == doctest::Approx(0).epsilon(1e-4));
        const dvec3 way = m_position.back() - m_position.front(), half = m_position[m_position.size() / 2];
        CHECK(length(cross(normalized(way), half - m_position.front())) < 1e-6 * length(way));
    }

    void checkStroll(double most_turn) const
    {
        CHECK(m_position.size() > 90);
        CHECK(m_position.size() <= 1800);
        checkRest(m_speed);
        CHECK(top(m_speed) < 1.4 + 1e-6);
        CHECK((top(m_speed) > 1.4 - 1e-6 || m_position.size() < 182)); // a second up, a second down
        CHECK(top(jumps(m_speed)) < 1.4 * 0.5 * 3.1416 / 90);          // half a sine wave up to 1.4 m/s
        CHECK(top(m_turn) > 30);
        CHECK(top(m_turn) < most_turn);
        CHECK(top(jumps(m_turn)) < 6);
        const dvec3 way = m_position.back() - m_position.front();
        for (const dvec3& p : m_position)
            CHECK(length(cross(normalized(way), p - m_position.front())) < 1e-9 + 1e-6 * length(way));
    }

    void checkLookAround() const
    {
        CHECK(m_position.size() == 1080); // 12 seconds
        CHECK(top(m_speed) < 1e-9);
        checkRest(m_turn);
        CHECK(top(m_turn) > 119.9);
        CHECK(top(m_turn) < 120.001);
        CHECK(top(jumps(m_turn)) < 7.1); // half a sine wave up to 120 in 0.3 s
        const dvec3 ahead = m_forward.front(), side = m_forward[turnedMost(ahead, 1)];
        CHECK(angle(ahead, m_forward.back()) < 1e-4);
        CHECK(angle(ahead, side) > 85);
        CHECK(dot(cross(ahead, side), cross(ahead, m_forward[turnedMost(ahead, -1)])) < 0); // to the other side too
    }

private:
    static double angle(dvec3 a, dvec3 b)
    {
        return std::atan2(length(cross(a, b)), dot(a, b)) * 180 / 3.14159265358979;
    }
    static double top(const std::vector<double>& values) { return *std::max_element(values.begin(), values.end()); }

    static std::vector<double> jumps(const std::vector<double>& values)
    {
        std::vector<double> jumps = {0};
        for (size_t i = 1; i < values.size(); ++i)
            jumps.push_back(std::abs(values[i] - values[i - 1]));
        return jumps;
    }

    static void checkRest(const std::vector<double>& values)
    {
        CHECK(values.front() < 0.02 * top(values));
        CHECK(values.back() < 0.02 * top(values));
    }

    // Where the gaze is farthest from `ahead`, to the side that `sign` says.
    [[nodiscard]] size_t turnedMost(dvec3 ahead, double sign) const
    {
        const dvec3 first = cross(ahead, m_forward[80]); // the first turn goes sideways
        size_t at = 0;
        double most = 0;
        for (size_t i = 0; i < m_forward.size(); ++i)
            if (const double turn = angle(ahead, m_forward[i]);
                sign * dot(first, cross(ahead, m_forward[i])) > 0 && turn > most) {
                most = turn;
                at = i;
            }
        return at;
    }

    const std::vector<dvec3>&m_position, &m_forward;
    std::vector<double> m_speed, m_turn;
};

} // namespace gsc::test
