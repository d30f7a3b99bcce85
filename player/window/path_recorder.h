// SPDX-License-Identifier: Apache-2.0
// Records the person's views as a trajectory (schemas/trajectory.schema.json), which every command can draw.
#pragma once

#include <gsc/camera.h>

#include <cstddef>
#include <string>
#include <vector>

namespace gsc {

// Samples arrive at irregular times; frames of a trajectory have an even rate from the first sample on. A frame whose
// time is a sample's, to a millionth of a frame, is that sample: parseCameraFile() returns its rotation, translation,
// angles and size bit for bit, and so eyeParams() and stereoPair() give equal results. Every other frame lies between
// two samples: its position is on the straight line, axes and angles change evenly, and size and appearance are those
// of the earlier sample.
class PathRecorder {
public:
    static constexpr size_t kMostFrames = 500'000; // 2.3 hours at 60 frames a second; later frames are left out

    // Begins a new recording. `name` is stated in the trajectory, with `fps` frames per second; `metre` is the number
    // of world units in a metre, 0 = unknown. Throws Error(Usage) if `fps` is not above 0 and at most 1000.
    void start(const std::string& name, double fps, double metre = 0);
    [[nodiscard]] bool records() const { return m_fps > 0; }
    [[nodiscard]] size_t frames() const { return m_frames.size(); } // number of frames recorded so far

    // Adds a sample at `seconds` of any clock. `ipd` is the distance of the eyes in world units, 0 = one eye; the file
    // states the first one above 0. Returns false if the sample is left out: its time is not after the last one's, it
    // is not finite, or no camera file can hold its size or angles. A scale in the rotation is removed. Throws
    // Error(Unsupported) if the middle of the camera's image lies off its axis, which a trajectory's frame cannot
    // state. Preconditions: start() was called; finishCamera() was called for `camera`, or it lacked nothing.
    bool add(double seconds, const Camera& camera, double ipd);

    // Writes the trajectory, ends the recording and returns the number of frames. Throws Error: Usage if there is no
    // frame; Io if the file cannot be written, or exists and `overwrite` is false. After an error the recording
    // continues, so that stop() can be tried again.
    size_t stop(const std::string& path, bool overwrite = false);

private:
    struct Sample {
        double seconds = 0;
        Camera camera;
    };

    std::string m_name;
    // frames per second (0 = nothing is being recorded); world units in a metre; distance of the eyes
    double m_fps = 0, m_metre = 0, m_ipd = 0;
    double m_begin = 0; // time of frame 0, seconds of the samples' clock
    Sample m_last;
    bool m_has_last = false;
    std::vector<Camera> m_frames;
};

} // namespace gsc
