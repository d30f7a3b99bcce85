// SPDX-License-Identifier: Apache-2.0
#include "convert/bake/state/bake_state.h"

#include <gsc/checksum.h>
#include <gsc/error.h>
#include <gsc/file/output_file.h>
#include "format/file/stand_in.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <limits>
#include <span>
#include <string_view>
#include <type_traits>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace gsc {

namespace {

constexpr char kStateMagic[8] = {'g', 's', 'c', '-', 'b', 'a', 'k', 'e'};
constexpr uint32_t kStateVersion = 1;
// Bytes per second of the disk, assumed until the first write was timed; least time between two writes, as a multiple
// of the time of a write.
constexpr double kBytesPerSecond = 1e9, kLeastPauses = 100;

struct StateHeader {
    char magic[8];        // offset 0
    uint32_t version;     // offset 8
    uint32_t facts_bytes; // offset 12: length of the text that follows this header
    uint64_t anchors;     // offset 16
    uint64_t slots;       // offset 24: slots of all anchors
    uint32_t most_poses;  // offset 32: most poses that a score can have
    uint32_t poses;       // offset 36: number of poses that importance was measured from
    uint32_t places;      // offset 40: number of places, see Importance::places
    uint32_t reserved;    // offset 44: zero
    BakeSizes before;     // offset 48: sizes of the source
    uint64_t checksum;    // offset 120: XXH3-64 of the fields above and of the text that follows
};
static_assert(sizeof(BakeSizes) == 72 && sizeof(StateHeader) == 128);
static_assert(std::is_trivially_copyable_v<StateHeader> && std::is_standard_layout_v<StateHeader>);

// Start of the record of a score. Behind it follow the PSNR of every pose (as many as a score can have, the unused ones
// 0) and XXH3-64 of all that.
struct ScoreRecord {
    uint32_t levers; // offset 0
    uint32_t first;  // offset 4: poses first to first + count - 1
    uint32_t count;  // offset 8
    uint32_t worst;  // offset 12: number of the pose with the lowest PSNR
    double error;    // offset 16
    ErrorCosts costs;
    double mse, psnr; // offset 64
};
static_assert(sizeof(ErrorCosts) == 40 && sizeof(ScoreRecord) == 80);
static_assert(std::is_trivially_copyable_v<ScoreRecord> && std::is_standard_layout_v<ScoreRecord>);

template <typename T>
std::span<const std::byte> bytesOf(const T& value)
{
    return std::as_bytes(std::span(&value, 1));
}

[[noreturn]] void failInUse(const std::string& path)
{
    throw Error(ErrorCode::Io, path, "another bake uses it", "one at a time",
                "wait for that one, or pass another --resume FILE");
}

[[noreturn]] void failState(const std::string& path, const char* found)
{
    throw Error(ErrorCode::InvalidFile, path, found, "what gsc bake --resume left there",
                "pass another name, or remove it to begin anew");
}

void readAt(const std::string& path, int fd, uint64_t offset, std::span<std::byte> bytes)
{
    while (!bytes.empty()) {
        const ssize_t done = ::pread(fd, bytes.data(), bytes.size(), off_t(offset));
        if (done < 0 && errno == EINTR)
            continue;
        if (done < 0)
            throw Error(ErrorCode::Io, path, formatString("cannot be read (%s)", std::strerror(errno)),
                        "the state of a bake", "pass another --resume FILE");
        if (done == 0)
            failState(path, "is damaged: it ends too early");
        bytes = bytes.subspan(size_t(done));
        offset += uint64_t(done);
    }
}

template <typename T>
std::span<std::byte> writable(T& value)
{
    return std::as_writable_bytes(std::span(&value, 1));
}

// Opens the file for reading, and sets `size`; the descriptor is -1 if there is no such file. `more`: further flags of
// open().
Descriptor openState(const std::string& path, uint64_t& size, int more = 0)
{
    Descriptor file{::open(resolveOutput(path).c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | more, 0666)};
    struct stat info {};
    if (file.fd < 0 && errno == ENOENT && more == 0)
        return file;
    if (file.fd < 0 || ::fstat(file.fd, &info) != 0)
        throw Error(ErrorCode::Io, path, formatString("cannot be opened (%s)", std::strerror(errno)),
                    "the state of a bake", "pass another --resume FILE");
    size = uint64_t(info.st_size);
    return file;
}

StateHeader readHeader(const std::string& path, int fd, uint64_t size)
{
    std::byte start[kStandInBytes];
    const std::span<std::byte> part(start, size_t(std::min<uint64_t>(size, sizeof(start))));
    readAt(path, fd, 0, part);
    refuseStandIn(part, size, path);
    StateHeader header{};
    if (size < sizeof(header))
        failState(path, "is no state of a bake");
    readAt(path, fd, 0, writable(header));
    if (std::memcmp(header.magic, kStateMagic, sizeof(kStateMagic)) != 0)
        failState(path, "is no state of a bake");
    if (header.version != kStateVersion)
        failState(path, "is the state of a bake of another version of gsc");
    return header;
}

uint64_t checksumOf(const StateHeader& header, std::string_view facts)
{
    Checksum64 sum;
    sum.update(bytesOf(header).first(offsetof(StateHeader, checksum)));
    sum.update(std::as_bytes(std::span(facts)));
    return sum.digest();
}

// Bytes of the arrays of an Importance, in the order of the file; writable if `importance` is.
template <typename Arrays>
auto arraysOf(Arrays& importance)
{
    const auto bytes = [](auto& array) {
        if constexpr (std::is_const_v<Arrays>)
            return std::as_bytes(std::span(array));
        else
            return std::as_writable_bytes(std::span(array));
    };
    return std::array{bytes(importance.weight), bytes(importance.place), bytes(importance.seen),
                      bytes(importance.alive)};
}

uint64_t bytesOfArrays(uint64_t anchors, uint64_t slots)
{
    return anchors + (2 * sizeof(float) + 1) * slots;
}

// First line in which the two texts differ, as each has it; empty for a text that ended before.
std::pair<std::string_view, std::string_view> difference(std::string_view one, std::string_view other)
{
    while (!one.empty() || !other.empty()) {
        const size_t a = std::min(one.find('\n'), one.size()), b = std::min(other.find('\n'), other.size());
        if (one.substr(0, a) != other.substr(0, b))
            return {one.substr(0, a), other.substr(0, b)};
        one.remove_prefix(std::min(a + 1, one.size()));
        other.remove_prefix(std::min(b + 1, other.size()));
    }
    return {};
}

} // namespace

BakeState::BakeState(const std::string& path, std::vector<std::string> facts, size_t most_poses, double seconds)
    : m_path(path), m_most_poses(most_poses), m_seconds(seconds)
{
    for (const std::string& fact : facts)
        m_facts += fact + "\n";
    checkOutput(path, OutputKind::Binary, true);
    open();
}

BakeState::~BakeState()
{
    struct stat owned {};
    if (m_owned.fd >= 0 && ::fstat(m_owned.fd, &owned) == 0 && owned.st_size == 0 && isOwned())
        ::unlink(resolveOutput(m_path).c_str()); // the file is empty, so no measurement is lost
}

void BakeState::own(Descriptor file)
{
    if (::flock(file.fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
        failInUse(m_path);
    m_owned = std::move(file);
    if (!isOwned())
        failInUse(m_path);
}

bool BakeState::isOwned() const
{
    struct stat there {
    }, owned{};
    return ::stat(resolveOutput(m_path).c_str(), &there) == 0 && ::fstat(m_owned.fd, &owned) == 0 &&
           there.st_dev == owned.st_dev && there.st_ino == owned.st_ino;
}

size_t BakeState::recordBytes() const
{
    return sizeof(ScoreRecord) + m_most_poses * sizeof(double) + sizeof(uint64_t);
}

void BakeState::open()
{
    uint64_t size = 0;
    own(openState(m_path, size, O_CREAT)); // locked: no other bake can use it now
    if (size == 0)
        return; // the file is new, or its bake was killed before it measured anything
    const StateHeader header = readHeader(m_path, m_owned.fd, size);
    if (header.facts_bytes > size - sizeof(header))
        failState(m_path, "is damaged: it ends too early");
    std::string facts(header.facts_bytes, '\0');
    readAt(m_path, m_owned.fd, sizeof(header), std::as_writable_bytes(std::span(facts)));
    if (header.checksum != checksumOf(header, facts))
        failState(m_path, "is damaged: the checksum of its header is another");
    if (const auto [is, wanted] = difference(facts, m_facts); is != wanted)
        throw Error(ErrorCode::InvalidFile, m_path,
                    formatString("is of another bake (%.*s)", int(is.size()), is.data()),
                    formatString("one of the same (%.*s)", int(wanted.size()), wanted.data()),
                    "pass what it began with or another --resume FILE, or remove it to begin anew");
    m_arrays = sizeof(header) + header.facts_bytes;
    const uint64_t arrays = bytesOfArrays(header.anchors, header.slots) + sizeof(uint64_t);
    if (header.most_poses != m_most_poses || header.poses == 0 || header.slots > size || header.anchors > size)
        failState(m_path, "is damaged: its numbers are of no such bake");
    if (arrays > size - m_arrays)
        failState(m_path, "is damaged: it ends too early");
    m_poses = header.poses;
    m_before = header.before;
    readScores(m_owned.fd, m_arrays + arrays, size);
}

void BakeState::readScores(int fd, uint64_t begin, uint64_t end)
{
    std::vector<std::byte> bytes(recordBytes());
    for (; begin + bytes.size() <= end; begin += bytes.size()) {
        readAt(m_path, fd, begin, bytes);
        ScoreRecord record{};
        uint64_t checksum = 0;
        std::memcpy(&record, bytes.data(), sizeof(record));
        std::memcpy(&checksum, bytes.data() + bytes.size() - sizeof(checksum), sizeof(checksum));
        if (checksum != checksum64(std::span(bytes).first(bytes.size() - sizeof(checksum)))) {
            if (begin + bytes.size() != end)
                failState(m_path, "is damaged: the checksum of a score is another");
            break; // after a power cut the file can be longer already but lack the new bytes
        }
        if (record.count > m_most_poses || record.worst >= record.count)
            failState(m_path, "is damaged: a score is of more poses than there are");
        std::vector<double> psnr(m_most_poses);
        std::memcpy(psnr.data(), bytes.data() + sizeof(record), psnr.size() * sizeof(double));
        Found found{{record.levers, record.error, record.costs}, record.first, {}};
        found.score.mse = record.mse;
        found.score.psnr = record.psnr;
        found.score.worst = record.worst;
        for (size_t i = 0; i < record.count; ++i)
            found.score.poses.push_back({{}, psnr[i]});
        m_scores.push_back(std::move(found));
    }
    if (begin != end)
        m_cut_from = begin;
}

void BakeState::read(Importance& importance) const
{
    const Descriptor file{::open(resolveOutput(m_path).c_str(), O_RDONLY | O_CLOEXEC)};
    StateHeader header{};
    readAt(m_path, file.fd, 0, writable(header));
    if (header.anchors != importance.seen.size() || header.slots != importance.weight.size())
        failState(m_path, "is damaged: it has other numbers of anchors and slots than the model");
    importance.poses = header.poses;
    importance.places = header.places;
    Checksum64 sum;
    uint64_t at = m_arrays;
    for (const std::span<std::byte> array : arraysOf(importance)) {
        readAt(m_path, file.fd, at, array);
        sum.update(array);
        at += array.size();
    }
    uint64_t checksum = 0;
    readAt(m_path, file.fd, at, writable(checksum));
    if (checksum != sum.digest())
        failState(m_path, "is damaged: the checksum of its weights is another");
}

bool BakeState::isDue(const Importance& importance) const
{
    if (m_seconds == 0)
        return true;
    const double cost =
        m_cost > 0 ? m_cost : double(bytesOfArrays(importance.seen.size(), importance.weight.size())) / kBytesPerSecond;
    const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - m_written;
    return passed.count() >= std::max(m_seconds, kLeastPauses * cost);
}

void BakeState::write(const BakeSizes& before, const Importance& importance)
{
    const auto start = std::chrono::steady_clock::now();
    StateHeader header{};
    std::memcpy(header.magic, kStateMagic, sizeof(kStateMagic));
    header.version = kStateVersion;
    header.facts_bytes = uint32_t(m_facts.size());
    header.anchors = importance.seen.size();
    header.slots = importance.weight.size();
    header.most_poses = uint32_t(m_most_poses);
    header.poses = importance.poses;
    header.places = importance.places;
    header.before = before;
    header.checksum = checksumOf(header, m_facts);
    if (!isOwned())
        failInUse(m_path);
    { // the block ends the life of the OutputFile when the file is complete
        OutputFile file(m_path, OutputKind::Binary, true);
        file.write(bytesOf(header));
        file.write(m_facts);
        Checksum64 sum;
        for (const std::span<const std::byte> array : arraysOf(importance)) {
            file.write(array);
            sum.update(array);
        }
        const uint64_t checksum = sum.digest();
        file.write(bytesOf(checksum));
        file.sync();
        file.commit();
    }
    uint64_t size = 0;
    own(openState(m_path, size));
    m_before = before;
    m_poses = importance.poses;
    m_arrays = sizeof(header) + m_facts.size();
    m_cut_from.reset();
    m_scores.clear();
    m_written = std::chrono::steady_clock::now();
    m_cost = std::chrono::duration<double>(m_written - start).count();
}

std::optional<SetScore> BakeState::take(const BakePlan& plan, size_t first, size_t count)
{
    const auto found = std::ranges::find_if(
        m_scores, [&](const Found& f) { return f.plan == plan && f.first == first && f.score.poses.size() == count; });
    if (found == m_scores.end())
        return std::nullopt;
    SetScore score = std::move(found->score);
    m_scores.erase(found);
    return score;
}

void BakeState::add(const BakePlan& plan, size_t first, size_t count, const SetScore& score)
{
    const ScoreRecord record{plan.levers, uint32_t(first), uint32_t(count), uint32_t(score.worst),
                             plan.error,  plan.costs,      score.mse,       score.psnr};
    std::vector<std::byte> bytes(recordBytes());
    std::memcpy(bytes.data(), &record, sizeof(record));
    for (size_t i = 0; i < count; ++i)
        std::memcpy(bytes.data() + sizeof(record) + i * sizeof(double), &score.poses[i].psnr, sizeof(double));
    const size_t before = bytes.size() - sizeof(uint64_t);
    const uint64_t checksum = checksum64(std::span(bytes).first(before));
    std::memcpy(bytes.data() + before, &checksum, sizeof(checksum));

    if (!isOwned())
        failInUse(m_path);
    const Descriptor file{::open(resolveOutput(m_path).c_str(), O_WRONLY | O_APPEND | O_CLOEXEC)};
    struct stat info {};
    if (file.fd < 0 || ::fstat(file.fd, &info) != 0 || (m_cut_from && ::ftruncate(file.fd, off_t(*m_cut_from)) != 0))
        failOutput(m_path, "cannot be written", errno);
    const off_t end = m_cut_from ? off_t(*m_cut_from) : info.st_size;
    m_cut_from.reset();
    ssize_t done = 0;
    do
        done = ::write(file.fd, bytes.data(), bytes.size());
    while (done < 0 && errno == EINTR);
    if (done != ssize_t(bytes.size()) || ::fsync(file.fd) != 0) {
        const int code = done < 0 || done == ssize_t(bytes.size()) ? errno : ENOSPC;
        (void)!::ftruncate(file.fd, end);
        failOutput(m_path, "cannot be written", code);
    }
}

void checkBakeState(const std::string& path)
{
    uint64_t size = 0;
    const Descriptor file = openState(path, size);
    if (file.fd >= 0 && size > 0)
        (void)readHeader(path, file.fd, size);
}

void removeBakeState(const std::string& path, std::vector<std::string>& warnings)
{
    if (!path.empty() && ::unlink(resolveOutput(path).c_str()) != 0 && errno != ENOENT)
        warnings.push_back(formatString("%s: cannot be removed (%s), expected to be, since the bake is done; remove it",
                                        path.c_str(), std::strerror(errno)));
}

} // namespace gsc
