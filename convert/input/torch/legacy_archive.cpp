// SPDX-License-Identifier: Apache-2.0
#include "convert/input/torch/legacy_archive.h"

#include <gsc/error.h>
#include "format/numbers/count_text.h"

#include <cstdint>
#include <cstring>
#include <string_view>
#include <utility>

namespace gsc {

namespace {

// Bytes of the 80-bit integer in the first pickle of such a file. From protocol 2 on they stand there as they are,
// before that as decimal digits.
constexpr std::string_view kMagic = "\x6c\xfc\x9c\x46\xf9\x20\x6a\xa8\x50\x19";
constexpr std::string_view kMagicDigits = "119547037146038801333356";
constexpr size_t kLeastMagic = 15;  // size of that pickle in bytes in protocol 2
constexpr int64_t kProtocol = 1001; // version of the file format; PyTorch never had another

constexpr std::pair<std::string_view, uint64_t> kElementBytes[] = {
    {"torch FloatStorage", 4}, {"torch DoubleStorage", 8}, {"torch HalfStorage", 2},  {"torch BFloat16Storage", 2},
    {"torch LongStorage", 8},  {"torch IntStorage", 4},    {"torch ShortStorage", 2}, {"torch CharStorage", 1},
    {"torch ByteStorage", 1},  {"torch BoolStorage", 1}};

class LegacyReader {
public:
    LegacyReader(std::span<const std::byte> bytes, const std::string& name) : m_left(bytes), m_name(name) {}

    LegacyArchive run()
    {
        takeMagic();
        checkProtocol(takePickle(m_left, m_name));
        checkMachine(takePickle(m_left, m_name));
        LegacyArchive archive{takePickle(m_left, m_name), {}};
        collectStorages(archive.graph);
        takeStorages(takePickle(m_left, m_name), archive);
        for (const auto& [key, storage] : m_storages)
            if (!storage.is_there)
                invalid("storage '" + shown(key) + "' is missing", "one for every tensor");
        return archive;
    }

private:
    struct Storage {
        std::string_view type;
        uint64_t count;
        bool is_there = false; // true once the elements were found in the file
    };

    static std::string shown(std::string_view text) { return std::string(text.substr(0, 64)); }

    [[noreturn]] void invalid(const std::string& found, const std::string& expected) const
    {
        throw Error(ErrorCode::InvalidFile, m_name, found, expected, "copy the file again");
    }

    void takeMagic()
    {
        std::string magic;
        if (m_left.size() >= kLeastMagic) {
            const PickleGraph graph = takePickle(m_left, m_name);
            magic = graph.values[graph.root].text;
        }
        if (magic != kWideInteger + std::string(kMagic) && magic != kWideInteger + std::string(kMagicDigits))
            invalid("starts as a pickle but not with the magic number of torch.save", "a file that torch.save wrote");
    }

    void checkProtocol(const PickleGraph& graph) const
    {
        const PickleValue& version = graph.values[graph.root];
        if (version.kind != PickleKind::Int || version.integer != kProtocol)
            throw Error(ErrorCode::Unsupported, m_name, "states an unknown protocol of torch.save", "1001",
                        "load it and save it again with a newer PyTorch");
    }

    void checkMachine(const PickleGraph& graph) const
    {
        const PickleValue& facts = graph.values[graph.root];
        if (facts.kind != PickleKind::Dict)
            invalid("holds no facts of the machine it was saved on", "what torch.save writes");
        for (size_t i = 0; i + 1 < facts.items.size(); i += 2) {
            const PickleValue& value = graph.values[facts.items[i + 1]];
            if (graph.values[facts.items[i]].text == "little_endian" && value.integer != 1)
                throw Error(ErrorCode::Unsupported, m_name, "was saved on a big-endian machine",
                            "little-endian numbers", "save it again on another");
        }
    }

    void collectStorages(const PickleGraph& graph)
    {
        for (const PickleValue& value : graph.values) {
            if (value.kind != PickleKind::Storage)
                continue;
            const Storage storage{graph.values[value.items[0]].text, uint64_t(value.integer)};
            const auto [found, is_new] = m_storages.emplace(value.text, storage);
            if (!is_new && (found->second.type != storage.type || found->second.count != storage.count))
                invalid("storage '" + shown(value.text) + "' is stated twice", "the same both times");
        }
    }

    // Finds the elements of every storage. `graph`: the pickle before them, a list of the storages' keys in the order
    // of the file.
    void takeStorages(const PickleGraph& graph, LegacyArchive& archive)
    {
        const PickleValue& list = graph.values[graph.root];
        if (list.kind != PickleKind::List)
            invalid("holds no list of its storages", "what torch.save writes");
        for (const uint32_t item : list.items) {
            const PickleValue& key = graph.values[item];
            if (key.kind != PickleKind::String)
                invalid("has a storage whose key is no text", "what torch.save writes");
            archive.storages.emplace(key.text, takeStorage(key.text));
        }
    }

    [[nodiscard]] uint64_t elementBytes(std::string_view type) const
    {
        for (const auto& [known, bytes] : kElementBytes)
            if (type == known)
                return bytes;
        throw Error(ErrorCode::Unsupported, m_name, "holds a " + shown(type), "a storage of numbers",
                    "export the state_dict with torch.save");
    }

    std::span<const std::byte> takeStorage(std::string_view key)
    {
        const auto found = m_storages.find(key);
        if (found == m_storages.end())
            invalid("storage '" + shown(key) + "' belongs to nothing", "those of its tensors");
        if (found->second.is_there)
            invalid("storage '" + shown(key) + "' occurs twice", "once");
        found->second.is_there = true;
        const uint64_t element = elementBytes(found->second.type);
        uint64_t count = 0;
        if (m_left.size() >= sizeof(count))
            std::memcpy(&count, m_left.data(), sizeof(count));
        if (m_left.size() < sizeof(count) || count > (m_left.size() - sizeof(count)) / element)
            invalid("ends within storage '" + shown(key) + "'", "all of it");
        if (count != found->second.count)
            invalid(formatString("storage '%s' has %s", shown(key).c_str(), formatCount(count, "element").c_str()),
                    formatString("the %llu of its tensor", static_cast<unsigned long long>(found->second.count)));
        const auto values = m_left.subspan(sizeof(count), size_t(count * element));
        m_left = m_left.subspan(sizeof(count) + values.size());
        return values;
    }

    std::span<const std::byte> m_left;
    const std::string& m_name;
    // Storages by key, as the pickle states them. The keys are views into the graph and not copies, because a hostile
    // file could use one long key any number of times.
    std::unordered_map<std::string_view, Storage> m_storages;
};

} // namespace

bool isLegacyArchive(std::span<const std::byte> bytes)
{
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    return text.starts_with('\x80') || (text.starts_with('L') && text.substr(1).starts_with(kMagicDigits));
}

LegacyArchive openLegacyArchive(std::span<const std::byte> bytes, const std::string& name)
{
    return LegacyReader(bytes, name).run();
}

} // namespace gsc
