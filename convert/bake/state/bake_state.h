// SPDX-License-Identifier: Apache-2.0
// File with the measurements of a bake, from which a stopped bake continues.
//
// [StateHeader][facts][weight][place][seen][alive][checksum][score record]...
//
// Little-endian, without gaps; about 1 byte per anchor and 9 per slot. All before the score records is written at once
// to a temporary file, which is then renamed. Score records, some hundred bytes each, are appended; one that was cut
// short, which can only be the last, is ignored.
#pragma once

#include "convert/bake/model/archive_size.h"
#include "convert/bake/model/reduced_model.h"
#include "convert/bake/pictures/picture_probe.h"
#include "convert/bake/weights/importance.h"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <unistd.h>

namespace gsc {

// Owns the descriptor of an open file, and closes it.
struct Descriptor {
    explicit Descriptor(int opened) : fd(opened) {}
    Descriptor(Descriptor&& other) noexcept : fd(std::exchange(other.fd, -1)) {}
    Descriptor& operator=(Descriptor&& other) noexcept
    {
        std::swap(fd, other.fd);
        return *this;
    }
    ~Descriptor()
    {
        if (fd >= 0)
            ::close(fd);
    }

    int fd;
};

class BakeState {
public:
    // Reads the file at `path`, except the importance, if it exists; else makes an empty one, which is removed if it
    // stays empty. Locks it until the end (flock). `facts`: lines "name: value" that the measurements depend on; a bake
    // continues only if those in the file are equal. `most_poses`: most poses of a score. `seconds`: least time between
    // two writes while importance is measured; 0 = no pause. Throws Error: InvalidFile for a file that is damaged, has
    // other facts or is no state of a bake, and leaves it unchanged; as checkOutput() of a binary file; Io, also if
    // another bake uses the file.
    BakeState(const std::string& path, std::vector<std::string> facts, size_t most_poses, double seconds);
    BakeState(BakeState&&) noexcept = default;
    BakeState& operator=(BakeState&&) = delete;
    ~BakeState();

    // Number of poses that the importance in the file was measured from; 0 = the file is new.
    [[nodiscard]] uint32_t poses() const { return m_poses; }
    [[nodiscard]] const BakeSizes& before() const { return m_before; } // sizes of the source; only if poses() > 0
    // returns true if the file has scores that take() has not returned yet
    [[nodiscard]] bool hasScores() const { return !m_scores.empty(); }

    // Reads the importance in the file into the arrays of `importance`, which must have the right sizes. Precondition:
    // poses() > 0. Throws Error(InvalidFile, Io).
    void read(Importance& importance) const;
    // Returns true if a write now would take less than a hundredth of the time since the last write.
    [[nodiscard]] bool isDue(const Importance& importance) const;
    // Replaces the file by one with this importance and without scores. Throws Error(Io) and then leaves the old file.
    void write(const BakeSizes& before, const Importance& importance);

    // Returns the score of `plan` from the poses [first, first + count) and removes it from this; none if the file has
    // none. Names of poses are empty. If there are several, the one written first is returned.
    std::optional<SetScore> take(const BakePlan& plan, size_t first, size_t count);
    // Appends a score to the file. Throws Error(Io) and then leaves the file as it was.
    void add(const BakePlan& plan, size_t first, size_t count, const SetScore& score);

private:
    struct Found {
        BakePlan plan;
        size_t first;
        SetScore score;
    };

    void open();
    void own(Descriptor file); // locks the file and keeps it, or throws
    [[nodiscard]] bool isOwned() const;
    void readScores(int fd, uint64_t begin, uint64_t end);
    [[nodiscard]] size_t recordBytes() const;

    std::string m_path, m_facts;
    size_t m_most_poses;
    double m_seconds, m_cost = 0; // least seconds between two writes; seconds that the last write took
    std::chrono::steady_clock::time_point m_written = std::chrono::steady_clock::now();
    Descriptor m_owned{-1}; // the locked file, open
    uint32_t m_poses = 0;
    BakeSizes m_before;
    uint64_t m_arrays = 0;              // byte offset of the arrays in the file
    std::optional<uint64_t> m_cut_from; // byte offset of a score record that was cut short
    std::vector<Found> m_scores;
};

// Checks before costly work: throws Error(InvalidFile, Io) if a file at `path` exists and is no state of this version.
void checkBakeState(const std::string& path);

// Removes the file of a finished bake; adds a warning if that fails. Does nothing for an empty path.
void removeBakeState(const std::string& path, std::vector<std::string>& warnings);

} // namespace gsc
