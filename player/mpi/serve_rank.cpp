// SPDX-License-Identifier: Apache-2.0
// A rank that draws for rank 0: one thread and any number of renderers, each with up to two frames in flight.
#include <gsc/error.h>
#include "player/mpi/mpi_renderer.h"
#include "player/mpi/wire.h"
#include "player/frames/content_hash.h"
#include <gsc/scene.h>
#include "runtime/devices/device_pictures.h"

#include <algorithm>
#include <cstring>
#include <deque>
#include <map>
#include <thread>

namespace gsc {

namespace {

// A frame that was requested and not yet replied to.
struct RankFrame {
    WireRequest request;
    std::shared_ptr<std::byte> memory;
    std::vector<FrameTarget> targets;
    uint64_t ticket = 0;

    [[nodiscard]] FrameRequest asked() const { return {{request.eyes, request.eye_count}, targets, request.options}; }
};

struct RankRenderer {
    std::unique_ptr<Renderer> renderer;
    std::shared_ptr<PictureMemory> pictures;
    std::deque<RankFrame> frames;
};

// Number of the GPU that this rank uses: the ranks of a machine take its usable GPUs in turn.
int deviceOf(const std::string& backend, int on_machine)
{
    std::vector<int> usable;
    if (!backend.starts_with("cpu"))
        for (const DeviceInfo& device : devices())
            if (device.usable && device.id.backend == "cuda")
                usable.push_back(device.id.ordinal);
    return usable.empty() ? 0 : usable[size_t(on_machine) % usable.size()];
}

class RankServer {
public:
    explicit RankServer(int on_machine) : m_on_machine(on_machine) {}

    // Serves one request, or ends one frame if no request is waiting. Returns false after the request to quit.
    bool serve()
    {
        if (!requestIsHere()) { // while no request is waiting, end a frame in flight
            for (auto& [number, own] : m_renderers)
                if (!own.frames.empty()) {
                    endFrame(number, own);
                    return true;
                }
        }
        WireRequest request;
        wireReceive(&request, sizeof(request), 0, kRequestTag);
        switch (request.command) {
        case WireCommand::Open:
            open(request.renderer);
            break;
        case WireCommand::Draw:
            draw(request);
            break;
        case WireCommand::DropCaches:
            dropCaches(request.renderer);
            break;
        case WireCommand::Close:
            while (!m_renderers[request.renderer].frames.empty())
                endFrame(request.renderer, m_renderers[request.renderer]);
            m_renderers.erase(request.renderer);
            break;
        case WireCommand::Quit:
            return false;
        }
        return true;
    }

private:
    static bool requestIsHere()
    {
        int here = 0;
        MPI_Iprobe(0, kRequestTag, MPI_COMM_WORLD, &here, MPI_STATUS_IGNORE);
        return here != 0;
    }

    static Error errorOf(const std::exception_ptr& error)
    {
        try {
            std::rethrow_exception(error);
        } catch (const Error& e) {
            return e;
        } catch (const std::exception& e) {
            return internalError("internal error", e.what(), "no such case");
        }
    }

    static void sendError(uint32_t number, const std::exception_ptr& error, uint64_t ticket)
    {
        WireReply reply;
        reply.ticket = ticket;
        const Error told = errorOf(error);
        reply.code = int32_t(told.code());
        const std::string* const parts[] = {&told.subject(), &told.found(), &told.expected(), &told.remedy()};
        for (size_t i = 0; i < std::size(parts); ++i)
            reply.part_bytes[i] = uint32_t(parts[i]->size());
        reply.setting_count = uint32_t(std::min(told.settings().size(), std::size(reply.settings)));
        std::copy_n(told.settings().begin(), reply.setting_count, reply.settings);
        wireSend(&reply, sizeof(reply), 0, replyTag(number));
        for (const std::string* part : parts)
            wireSend(part->data(), part->size(), 0, replyTag(number));
    }

    void open(uint32_t number)
    {
        WireOpen open;
        wireReceive(&open, sizeof(open), 0, replyTag(number));
        try {
            std::shared_ptr<const Scene> scene = Scene::open(open.path, open.verify != 0);
            if (const uint64_t file = fileHash(open.path); file != open.file)
                throw Error(ErrorCode::InvalidFile, open.path,
                            formatString("another file than rank 0 has, of checksum %016llx",
                                         static_cast<unsigned long long>(file)),
                            formatString("%016llx", static_cast<unsigned long long>(open.file)),
                            "give all ranks the same file");
            RankRenderer own;
            own.renderer = makeRenderer({open.backend, deviceOf(open.backend, m_on_machine)}, open.options);
            own.renderer->load(std::move(scene));
            own.pictures = hostPictures(!own.renderer->onHost());
            const DeviceFacts facts = own.renderer->device();
            WireReply reply;
            reply.tier_exact = uint32_t(own.renderer->tierOf(Tier::Exact));
            reply.tier_fast = uint32_t(own.renderer->tierOf(Tier::Fast));
            reply.processors = facts.processors;
            reply.memory_bytes = facts.memory_bytes;
            facts.name.copy(reply.device, sizeof(reply.device) - 1);
            m_renderers[number] = std::move(own);
            wireSend(&reply, sizeof(reply), 0, replyTag(number));
        } catch (...) {
            sendError(number, std::current_exception(), 0);
        }
    }

    // Ignores errors: a broken renderer fails at the next frame, too, and that frame's reply reports it.
    void dropCaches(uint32_t number)
    {
        const auto found = m_renderers.find(number);
        try {
            if (found != m_renderers.end())
                found->second.renderer->dropCaches();
        } catch (...) {
        }
    }

    void draw(const WireRequest& request)
    {
        RankRenderer& own = m_renderers[request.renderer];
        try {
            if (own.renderer == nullptr)
                throw internalError("frame", "its renderer is not open", "it to be");
            RankFrame frame;
            frame.request = request;
            size_t bytes = 0;
            for (uint32_t e = 0; e < request.eye_count; ++e)
                bytes += size_t(request.eyes[e].width) * request.eyes[e].height *
                             (pixelBytes(request.format) + sizeof(float)) +
                         16; // 16 bytes of padding for two planes, each of which begins at a multiple of 8 bytes
            frame.memory = own.pictures->take(bytes);
            std::byte* at = frame.memory.get();
            for (uint32_t e = 0; e < request.eye_count; ++e) {
                const size_t pixels = size_t(request.eyes[e].width) * request.eyes[e].height;
                FrameTarget& target = frame.targets.emplace_back();
                target.kind = FrameTarget::Kind::Host;
                target.format = request.format;
                target.pixels = at;
                at += (pixels * pixelBytes(request.format) + 7) / 8 * 8;
                if (request.wants_depth)
                    target.depth = reinterpret_cast<float*>(at);
                at += request.wants_depth ? (pixels * sizeof(float) + 7) / 8 * 8 : 0;
            }
            own.frames.push_back(std::move(frame));
            own.frames.back().ticket = own.renderer->submit(own.frames.back().asked());
        } catch (...) {
            const std::exception_ptr error = std::current_exception();
            if (!own.frames.empty() && own.frames.back().request.ticket == request.ticket)
                own.frames.pop_back();
            while (!own.frames.empty()) // replies are sent in the order of the requests
                endFrame(request.renderer, own);
            sendError(request.renderer, error, request.ticket);
        }
    }

    void endFrame(uint32_t number, RankRenderer& own)
    {
        const RankFrame frame = std::move(own.frames.front());
        own.frames.pop_front();
        WireReply reply;
        reply.ticket = frame.request.ticket;
        try {
            reply.result = finish(*own.renderer, frame.asked(), frame.ticket);
        } catch (...) {
            return sendError(number, std::current_exception(), frame.request.ticket);
        }
        wireSend(&reply, sizeof(reply), 0, replyTag(number));
        for (uint32_t e = 0; e < frame.request.eye_count; ++e) {
            const FrameTarget& target = frame.targets[e];
            const EyeParams& eye = frame.request.eyes[e];
            sendPart(number, target.pixels, wirePart(frame.request.options, eye, pixelBytes(target.format)),
                     pitchOf(target, eye.width));
            if (frame.request.wants_depth)
                sendPart(number, target.depth, wirePart(frame.request.options, eye, sizeof(float)),
                         depthPitchOf(target, eye.width));
        }
    }

    void sendPart(uint32_t number, const void* from, const WirePart& part, size_t pitch)
    {
        const auto* const first = static_cast<const std::byte*>(from) + part.offset;
        if (pitch == part.row)
            return wireSend(first, part.bytes(), 0, replyTag(number));
        m_packed.resize(part.bytes());
        for (size_t y = 0; y < part.rows; ++y)
            std::memcpy(m_packed.data() + y * part.row, first + y * pitch, part.row);
        wireSend(m_packed.data(), m_packed.size(), 0, replyTag(number));
    }

    int m_on_machine;
    std::map<uint32_t, RankRenderer> m_renderers;
    std::vector<std::byte> m_packed;
};

} // namespace

void serveRank(int on_machine)
{
    RankServer server(on_machine);
    while (server.serve()) {
    }
}

} // namespace gsc
