// SPDX-License-Identifier: Apache-2.0
// Measurements of a bake, in a file, so that a bake that was stopped goes on from there.
//
//   [StateHeader][facts][weight][place][seen][alive][checksum][score record]...
//
// Little-endian, nothing between the parts; 1 byte an anchor and 9 a slot, and few beside them. All but the records is
// written at once, to a temporary that is then renamed. A record, of some hundred bytes, is added behind; one that was cut
// short, which can only be the last, is as if it had never been.
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
    // Reads the file at `path` where there is one, but for its importance. `facts`: lines "name: value", all that what is
    // measured depends on, and the same where a bake goes on. `most_poses`: of a score. `seconds`: between two files that
    // are written while importance is found, at least; 0 = no pause is needed. Throws Error: InvalidFile for a file that is
    // damaged, of other facts or no state at all, which then stays as it is; as checkOutput() of a binary file; Io, also
    // where another bake has it. From then on the file is this one's (flock); an empty one stands there until there is
    // more, and goes with this.
    BakeState(const std::string& path, std::vector<std::string> facts, size_t most_poses, double seconds);
    BakeState(BakeState&&) noexcept = default;
    BakeState& operator=(BakeState&&) = delete;
    ~BakeState();

    // Poses that the importance in the file was found from; 0 = there is no file.
    [[nodiscard]] uint32_t poses() const { return m_poses; }
    [[nodiscard]] const BakeSizes& before() const { return m_before; } // of the source; of a file that there is
    [[nodiscard]] bool hasScores() const { return !m_scores.empty(); } // that were found there and not taken

    // Reads the file's importance straight into the arrays, which have its sizes. Precondition: poses() > 0. Throws
    // Error(InvalidFile, Io).
    void read(Importance& importance) const;
    // Whether so much time has passed that writing takes less than a hundredth of it.
    [[nodiscard]] bool isDue(const Importance& importance) const;
    // Replaces the file by one of this importance and no score, from the arrays as they lie. Throws Error(Io): the file is
    // then the one before.
    void write(const BakeSizes& before, const Importance& importance);

    // The first score that was found of a plan from the poses [first, first + count), once, without the poses' names.
    std::optional<SetScore> take(const BakePlan& plan, size_t first, size_t count);
    // Adds one to the file. Throws Error(Io): the file is then as it was.
    void add(const BakePlan& plan, size_t first, size_t count, const SetScore& score);

private:
    struct Found {
        BakePlan plan;
        size_t first;
        SetScore score;
    };

    void open();
    void own(Descriptor file); // takes it over, or throws
    [[nodiscard]] bool isOwned() const;
    void readScores(int fd, uint64_t begin, uint64_t end);
    [[nodiscard]] size_t recordBytes() const;

    std::string m_path, m_facts;
    size_t m_most_poses;
    double m_seconds, m_cost = 0; // of the last write, in seconds
    std::chrono::steady_clock::time_point m_written = std::chrono::steady_clock::now();
    Descriptor m_owned{-1}; // the file, as long as it is this one's
    uint32_t m_poses = 0;
    BakeSizes m_before;
    uint64_t m_arrays = 0;              // where they begin in the file
    std::optional<uint64_t> m_cut_from; // where a record begins that was cut short
    std::vector<Found> m_scores;
};

// For a start, before anything costly is done: is what there is at `path`, if there is something, a state of this version?
// Throws Error(InvalidFile, Io) if not.
void checkBakeState(const std::string& path);

// Removes a file that is not needed any more; where that fails `warnings` says so. Does nothing for an empty path.
void removeBakeState(const std::string& path, std::vector<std::string>& warnings);

} // namespace gsc
