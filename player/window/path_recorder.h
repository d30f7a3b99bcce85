// SPDX-License-Identifier: Apache-2.0
// Recording of a person's views, as a trajectory (schemas/trajectory.schema.json) that every command draws again.
#pragma once

#include <gsc/camera.h>

#include <cstddef>
#include <string>
#include <vector>

namespace gsc {

// Samples come when the screen takes them, frames of a trajectory at an even rate from the first sample on. A frame whose
// time is a sample's, to a millionth of a frame, is that sample: parseCameraFile() gives back its rotation, translation,
// angles and size bit for bit, and so eyeParams() and stereoPair() do. Every other frame lies between two samples:
// position on the straight line, axes and angles at an even rate, size and appearance the earlier one's.
class PathRecorder {
public:
    static constexpr size_t kMostFrames = 500'000; // 2.3 hours at 60 a second; later frames are left out

    // Begins a new recording. `name` is the trajectory's, `fps` its frames per second, `metre` world units, 0 =
    // unknown. Throws Error(Usage) where `fps` is not above 0 and at most 1000.
    void start(const std::string& name, double fps, double metre = 0);
    [[nodiscard]] bool records() const { return m_fps > 0; }
    [[nodiscard]] size_t frames() const { return m_frames.size(); } // frames so far

    // `seconds` of any clock; `ipd` is the distance of the eyes in world units, 0 = one eye, and the first above 0 is the
    // file's. Returns false where the sample is left out: its time is not after the last one's, it is not finite, or no
    // camera file can hold its size or angles. A rotation with a scale loses it. Throws Error(Unsupported) for a
    // camera whose image's middle lies off its axis, because frames of a trajectory have none.
    // Preconditions: start(); finishCamera() was called or nothing was open.
    bool add(double seconds, const Camera& camera, double ipd);

    // Writes the trajectory, ends the recording and returns its frames. Throws Error: Usage where there is no frame, Io
    // where the file cannot be written or, without `overwrite`, is there; the recording then goes on, for another try.
    size_t stop(const std::string& path, bool overwrite = false);

private:
    struct Sample {
        double seconds = 0;
        Camera camera;
    };

    std::string m_name;
    double m_fps = 0, m_metre = 0, m_ipd = 0; // m_fps 0: no recording
    double m_begin = 0;                       // time of frame 0, seconds
    Sample m_last;
    bool m_has_last = false;
    std::vector<Camera> m_frames;
};

} // namespace gsc
