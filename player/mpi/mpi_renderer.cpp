// SPDX-License-Identifier: Apache-2.0
#include "player/mpi/mpi_renderer.h"

#include <gsc/error.h>
#include "player/mpi/wire.h"
#include "player/frames/content_hash.h"
#include "player/model/converted_model.h"
#include "runtime/backend/frame_checks.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <deque>
#include <map>
#include <mutex>
#include <thread>

namespace gsc {

namespace {

std::atomic<uint64_t> s_all_bytes = 0, s_picture_bytes = 0;
std::atomic<uint32_t> s_renderers = 0, s_alive = 0;

// Cuts a message into pieces, because MPI counts bytes as int. Pieces need no number: MPI keeps messages of one tag in
// order.
template <typename Each>
void forEachPiece(size_t bytes, const Each& each)
{
    constexpr size_t kMost = size_t(1) << 30;
    for (size_t at = 0; at < bytes; at += kMost)
        each(at, int(std::min(kMost, bytes - at)));
}

void receivePiece(void* data, int bytes, int rank, int tag)
{
    using Clock = std::chrono::steady_clock;
    constexpr auto kAtOnce = std::chrono::microseconds(200), kNap = std::chrono::microseconds(50);
    MPI_Request request;
    MPI_Irecv(data, bytes, MPI_BYTE, rank, tag, MPI_COMM_WORLD, &request);
    const Clock::time_point start = Clock::now();
    for (;;) {
        int done = 0;
        MPI_Test(&request, &done, MPI_STATUS_IGNORE);
        if (done != 0)
            return;
        if (Clock::now() - start > kAtOnce)
            std::this_thread::sleep_for(kNap);
    }
}

// Checksum of the file when this process opened it first. A renderer that is made again later must refuse a file that
// has replaced it: the other workers still draw the first one.
uint64_t openedFile(const std::string& path)
{
    static std::mutex s_mutex;
    static std::map<std::string, uint64_t> s_files;
    const std::lock_guard lock(s_mutex);
    const auto known = s_files.find(path);
    return known != s_files.end() ? known->second : s_files.emplace(path, fileHash(path)).first->second;
}

// Turns an opening error of another rank into Usage if its file is missing, damaged or a different one. After Io and
// InvalidFile the service would try again, in vain; Usage ends it with a message, so that no machine of the job idles
// unnoticed.
ErrorCode codeOfOpening(ErrorCode code)
{
    return code == ErrorCode::Io || code == ErrorCode::InvalidFile ? ErrorCode::Usage : code;
}

class MpiRenderer final : public Renderer {
public:
    MpiRenderer(int rank, const ModelChoice& model, const std::string& backend, const RendererOptions& limits)
        : m_rank(rank), m_number(++s_renderers), m_model(model), m_backend(backend), m_limits(limits)
    {
        ++s_alive;
    }
    ~MpiRenderer() override
    {
        close();
        --s_alive;
    }
    MpiRenderer(const MpiRenderer&) = delete;
    MpiRenderer& operator=(const MpiRenderer&) = delete;

    [[nodiscard]] DeviceId id() const override { return {"rank", m_rank}; }
    [[nodiscard]] DeviceFacts device() const override { return m_facts; }
    [[nodiscard]] bool onHost() const override { return true; } // pictures come in memory of this process
    [[nodiscard]] Tier tierOf(Tier asked) const override { return asked == Tier::Exact ? m_tiers[0] : m_tiers[1]; }

    using Renderer::load;
    void load(const ModelView&) override // the view is ignored: the other rank opens the file itself
    {
        close();
        WireOpen open;
        const std::string path = gscPath(m_model.file);
        open.file = openedFile(m_model.file);
        open.verify = m_model.verify;
        open.options = m_limits;
        if (m_backend.size() >= sizeof(open.backend) || path.size() >= sizeof(open.path))
            throw Error(ErrorCode::Usage, m_model.file, formatString("a path of %zu bytes", path.size()),
                        formatString("fewer than %zu", sizeof(open.path)), "use a shorter one");
        m_backend.copy(open.backend, sizeof(open.backend) - 1);
        path.copy(open.path, sizeof(open.path) - 1);
        send(WireCommand::Open);
        // no other thread sends this renderer a message in between
        wireSend(&open, sizeof(open), m_rank, replyTag(m_number));
        m_open = true;
        const WireReply reply = receiveReply(codeOfOpening);
        m_facts.name = reply.device;
        m_facts.processors = reply.processors;
        m_facts.memory_bytes = reply.memory_bytes;
        m_tiers[0] = Tier(reply.tier_exact);
        m_tiers[1] = Tier(reply.tier_fast);
    }

    void dropCaches() override { send(WireCommand::DropCaches); }

    uint64_t submit(const FrameRequest& request) override
    {
        checkInFlight(m_flying.size());
        Flying flying;
        WireRequest& wire = flying.request;
        wire.command = WireCommand::Draw;
        wire.renderer = m_number;
        wire.ticket = ++m_tickets;
        wire.eye_count = uint32_t(request.eyes.size());
        std::ranges::copy(request.eyes, wire.eyes);
        wire.options = request.options;
        flying.targets.assign(request.targets.begin(), request.targets.end());
        for (const FrameTarget& target : request.targets) {
            if (target.kind > FrameTarget::Kind::Device || target.format != request.targets.front().format)
                throw Error(ErrorCode::Unsupported, "target",
                            "not memory, or of two formats, of a renderer of another rank", "memory of this process",
                            "use that");
            wire.wants_depth = wire.wants_depth || target.hasDepth();
            wire.format = target.format;
        }
        send(wire);
        return m_flying.emplace_back(std::move(flying)).request.ticket;
    }

    FrameState wait(uint64_t ticket, FrameResult& result, std::chrono::nanoseconds most) override
    {
        const auto found = std::ranges::find(m_flying, ticket, [](const Flying& f) { return f.request.ticket; });
        if (found == m_flying.end())
            throwNotInFlight(ticket);
        const auto until = std::chrono::steady_clock::now();
        while (!found->done) { // replies come in the order of the requests
            if (most < std::chrono::hours(1) && !replyIsHere()) {
                if (std::chrono::steady_clock::now() - until >= most)
                    return FrameState::Pending;
                std::this_thread::sleep_for(std::chrono::microseconds(20));
                continue;
            }
            receiveFrame(*std::ranges::find(m_flying, false, &Flying::done));
        }
        const Flying flying = std::move(*found);
        m_flying.erase(found);
        if (flying.error)
            std::rethrow_exception(flying.error);
        result = flying.result;
        return FrameState::Done;
    }

private:
    struct Flying {
        WireRequest request;
        std::vector<FrameTarget> targets;
        bool done = false;
        FrameResult result;
        std::exception_ptr error;
    };

    void send(const WireRequest& request) const { wireSend(&request, sizeof(request), m_rank, kRequestTag); }

    void send(WireCommand command) const
    {
        WireRequest request;
        request.command = command;
        request.renderer = m_number;
        send(request);
    }

    [[nodiscard]] bool replyIsHere() const
    {
        int here = 0;
        MPI_Iprobe(m_rank, replyTag(m_number), MPI_COMM_WORLD, &here, MPI_STATUS_IGNORE);
        return here != 0;
    }

    // Receives a reply. Throws the other rank's Error, with its code changed by `code_of`.
    WireReply receiveReply(ErrorCode (*code_of)(ErrorCode) = [](ErrorCode code) { return code; }) const
    {
        WireReply reply;
        wireReceive(&reply, sizeof(reply), m_rank, replyTag(m_number));
        s_all_bytes += sizeof(reply);
        if (reply.code == 0)
            return reply;
        std::string parts[4];
        for (size_t i = 0; i < std::size(parts); ++i) {
            parts[i].resize(reply.part_bytes[i]);
            wireReceive(parts[i].data(), parts[i].size(), m_rank, replyTag(m_number));
        }
        throw Error(code_of(ErrorCode(reply.code)), formatString("rank %d: %s", m_rank, parts[0].c_str()), parts[1],
                    parts[2], parts[3])
            .with({reply.settings, reply.settings + reply.setting_count});
    }

    void receiveFrame(Flying& flying)
    {
        flying.done = true;
        try {
            flying.result = receiveReply().result;
        } catch (...) {
            flying.error = std::current_exception();
            return;
        }
        for (size_t e = 0; e < flying.targets.size(); ++e) {
            const EyeParams& eye = flying.request.eyes[e];
            const FrameTarget& target = flying.targets[e];
            receivePart(target.pixels, wirePart(flying.request.options, eye, pixelBytes(target.format)),
                        pitchOf(target, eye.width));
            if (flying.request.wants_depth)
                receivePart(target.depth, wirePart(flying.request.options, eye, sizeof(float)),
                            depthPitchOf(target, eye.width));
        }
    }

    // Receives the pixels or depths of a part into `to`, whose rows are `pitch` bytes apart: directly if the rows lie
    // without gaps, else through a buffer. `to` is null if they are not wanted.
    void receivePart(void* to, const WirePart& part, size_t pitch)
    {
        s_all_bytes += part.bytes();
        s_picture_bytes += part.bytes();
        auto* const first = static_cast<std::byte*>(to) + part.offset;
        if (to != nullptr && pitch == part.row)
            return wireReceive(first, part.bytes(), m_rank, replyTag(m_number));
        m_rows.resize(part.bytes());
        wireReceive(m_rows.data(), part.bytes(), m_rank, replyTag(m_number));
        for (size_t y = 0; to != nullptr && y < part.rows; ++y)
            std::memcpy(first + y * pitch, m_rows.data() + y * part.row, part.row);
    }

    // Receives and drops the replies that are still to come, so that the other rank can finish sending; then closes
    // its renderer.
    void close()
    {
        for (Flying& flying : m_flying)
            if (!flying.done) {
                std::ranges::fill(flying.targets, FrameTarget{FrameTarget::Kind::None, flying.request.format});
                receiveFrame(flying);
            }
        m_flying.clear();
        if (std::exchange(m_open, false))
            send(WireCommand::Close);
    }

    int m_rank;
    uint32_t m_number;
    ModelChoice m_model;
    std::string m_backend;
    RendererOptions m_limits;
    bool m_open = false;
    DeviceFacts m_facts;
    Tier m_tiers[2] = {};
    uint64_t m_tickets = 0;
    std::deque<Flying> m_flying;
    std::vector<std::byte> m_rows;
};

} // namespace

void wireSend(const void* data, size_t bytes, int rank, int tag)
{
    forEachPiece(bytes, [&](size_t at, int piece) {
        MPI_Send(static_cast<const std::byte*>(data) + at, piece, MPI_BYTE, rank, tag, MPI_COMM_WORLD);
    });
}

void wireReceive(void* data, size_t bytes, int rank, int tag)
{
    forEachPiece(bytes,
                 [&](size_t at, int piece) { receivePiece(static_cast<std::byte*>(data) + at, piece, rank, tag); });
}

std::unique_ptr<Renderer> makeMpiRenderer(int rank, const ModelChoice& model, const std::string& backend,
                                          const RendererOptions& limits)
{
    return std::make_unique<MpiRenderer>(rank, model, backend, limits);
}

WireBytes wireBytes()
{
    return {s_all_bytes, s_picture_bytes};
}

bool ranksHang()
{
    return s_alive > 0;
}

void endRanks()
{
    int ranks = 0;
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    for (int rank = 1; rank < ranks; ++rank) {
        const WireRequest quit;
        wireSend(&quit, sizeof(quit), rank, kRequestTag);
    }
}

} // namespace gsc
