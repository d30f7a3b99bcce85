// SPDX-License-Identifier: Apache-2.0
#include "convert/input/torch/torch_archive.h"

#include "convert/input/torch/legacy_archive.h"
#include "convert/input/torch/pickle_machine.h"
#include "convert/input/torch/zip_archive.h"
#include "format/error.h"

#include <bit>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <set>
#include <string_view>

static_assert(std::endian::native == std::endian::little, "tensors and PLY rows are copied as they lie");

namespace gsc {

namespace {

constexpr size_t kMaxDepth = 16;      // of modules within modules; upstream's reach 2
constexpr size_t kMaxPath = 512;      // characters of a tensor's or a module's name
constexpr size_t kMaxVisits = 100000; // dictionary entries; a graph of shared values can unfold exponentially

std::string text(const std::vector<std::byte>& bytes)
{
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// Last part of "__torch__.torch.nn.modules.linear.___torch_mangle_0 Linear".
std::string shortClass(const std::string& global)
{
    return global.substr(global.find_last_of(" .") + 1);
}

// The bytes of a tensor's storage, as many as it states; they may be put into the scratch.
using ReadStorage = std::function<std::span<const std::byte>(const PickleTensor&, std::vector<std::byte>& scratch)>;

class Walker {
public:
    Walker(const PickleGraph& graph, const ReadStorage& read, const WantedTensor& wanted, size_t archive_bytes,
           const std::string& name)
        : m_graph(graph), m_read(read), m_wanted(wanted), m_floats_left(archive_bytes / sizeof(float)), m_name(name)
    {
    }

    TorchArchive run()
    {
        const PickleValue& root = m_graph.values[m_graph.root];
        if (root.kind == PickleKind::Object) {
            m_archive.is_script = true;
            m_archive.root_class = shortClass(root.text);
            walkObject(root, "", 0);
        } else if (root.kind == PickleKind::Dict) {
            walkDict(root, "", 0);
        } else {
            throw Error(ErrorCode::Unsupported,
                        m_name + ": holds neither a module nor a dictionary, expected the MLPs of a saved model; "
                                 "training checkpoints (chkpnt*.pth) do not hold the anchor features, pass the "
                                 "point_cloud/iteration_<n> folder");
        }
        return std::move(m_archive);
    }

private:
    [[noreturn]] void invalid(const std::string& message) const
    {
        throw Error(ErrorCode::InvalidFile, m_name + ": " + message + "; save it again");
    }

    void walkObject(const PickleValue& object, const std::string& path, size_t depth)
    {
        if (object.items.empty())
            return; // no state: nothing below it
        walkDict(m_graph.values[object.items[0]], path, depth);
    }

    void walkDict(const PickleValue& dict, const std::string& path, size_t depth)
    {
        if (depth > kMaxDepth)
            invalid(formatString("modules are nested deeper than %zu levels, expected 2", kMaxDepth));
        std::set<std::string_view> seen;
        for (size_t i = 0; i + 1 < dict.items.size(); i += 2) {
            if (++m_visits > kMaxVisits)
                invalid(formatString("more than %zu entries, expected about 20", kMaxVisits));
            const PickleValue& key = m_graph.values[dict.items[i]];
            if (key.kind != PickleKind::String)
                continue; // nothing of ours has such a key
            // before it is copied: one text can be a key of any number of dictionaries
            if (path.size() + key.text.size() > kMaxPath)
                invalid(formatString("key '%.64s' makes a name of %zu characters, expected at most %zu",
                                     key.text.c_str(), path.size() + key.text.size(), kMaxPath));
            if (!seen.insert(key.text).second)
                invalid("key '" + path + key.text + "' occurs twice, expected once");
            const PickleValue& value = m_graph.values[dict.items[i + 1]];
            if (value.kind == PickleKind::Tensor) {
                addTensor(m_graph.tensors[size_t(value.integer)], path + key.text);
            } else if (value.kind == PickleKind::Dict) {
                walkDict(value, path + key.text + '.', depth + 1);
            } else if (value.kind == PickleKind::Object) {
                m_archive.modules.emplace_back(path + key.text, shortClass(value.text));
                walkObject(value, path + key.text + '.', depth + 1);
            }
        }
    }

    void addTensor(const PickleTensor& source, const std::string& path)
    {
        if (m_wanted && !m_wanted(path))
            return;
        if (source.storage_type != "torch FloatStorage")
            throw Error(ErrorCode::Unsupported,
                        formatString("%s: tensor '%s' is a %s, expected float32 as the trainers save it; convert it "
                                     "with .float() and save again",
                                     m_name.c_str(), path.c_str(), source.storage_type.c_str()));
        // note: divisions instead of products, because dimensions come from the file
        uint64_t count = 1;
        for (const uint64_t size : source.shape)
            if (size == 0)
                count = 0;
        for (size_t i = source.shape.size(); count != 0 && i-- > 0;) {
            if (source.shape[i] > source.storage_count / count)
                invalid("tensor '" + path + "' is larger than its storage, expected it to fit");
            if (source.shape[i] != 1 && source.stride[i] != count)
                throw Error(ErrorCode::Unsupported,
                            m_name + ": tensor '" + path +
                                "' is not contiguous, expected row-major; call .contiguous() and save again");
            count *= source.shape[i];
        }
        if (source.offset > source.storage_count || count > source.storage_count - source.offset)
            invalid("tensor '" + path + "' reaches beyond its storage, expected it to fit");
        // no trainer shares a storage between tensors; a hostile file could, to be read a million times
        if (source.storage_count > m_floats_left)
            invalid("tensors hold more values than the archive has bytes for, expected one storage per tensor");
        m_floats_left -= source.storage_count;

        std::vector<std::byte> scratch;
        const std::span<const std::byte> bytes = m_read(source, scratch);
        NamedTensor tensor{path, source.shape, std::vector<float>(count)};
        if (count != 0)
            std::memcpy(tensor.values.data(), bytes.data() + source.offset * sizeof(float), count * sizeof(float));
        m_archive.tensors.push_back(std::move(tensor));
    }

    const PickleGraph& m_graph;
    const ReadStorage& m_read;
    const WantedTensor& m_wanted;
    uint64_t m_floats_left;
    const std::string& m_name;
    size_t m_visits = 0;
    TorchArchive m_archive;
};

void checkVersion(const ZipArchive& zip, const std::string& prefix, const std::string& name)
{
    if (zip.contains(prefix + "byteorder")) {
        const std::string order = text(zip.read(prefix + "byteorder"));
        if (order != "little")
            throw Error(ErrorCode::Unsupported, name + ": byte order is '" + order.substr(0, 16) +
                                                    "', expected 'little'; save it again on a little-endian machine");
    }
    if (!zip.contains(prefix + "version"))
        return;
    const std::string version = text(zip.read(prefix + "version"));
    const long number = std::strtol(version.c_str(), nullptr, 10);
    if (number < 1 || number > 10)
        throw Error(ErrorCode::Unsupported, formatString("%s: archive version is '%.8s', expected 1 to 10; save it "
                                                         "again with an older PyTorch",
                                                         name.c_str(), version.c_str()));
}

TorchArchive readLegacy(std::span<const std::byte> bytes, const std::string& name, const WantedTensor& wanted)
{
    const LegacyArchive archive = openLegacyArchive(bytes, name);
    const ReadStorage read = [&](const PickleTensor& tensor, std::vector<std::byte>&) {
        return archive.storages.at(tensor.storage_key);
    };
    return Walker(archive.graph, read, wanted, bytes.size(), name).run();
}

} // namespace

TorchArchive readTorchArchive(std::span<const std::byte> bytes, const std::string& name, const WantedTensor& wanted)
{
    if (!bytes.empty() && bytes[0] == std::byte(0x80))
        return readLegacy(bytes, name, wanted);
    const ZipArchive zip(bytes, name);
    // Every member lies below one folder, the file's stem when it was saved; renaming a file does not change it.
    const std::string& first = zip.members().front();
    const size_t slash = first.find('/');
    if (slash == std::string::npos)
        throw Error(ErrorCode::InvalidFile, name + ": archive member '" + first.substr(0, 64) +
                                                "' lies in no folder, expected a PyTorch archive; pass the file that "
                                                "the trainer saved");
    const std::string prefix = first.substr(0, slash + 1);
    checkVersion(zip, prefix, name);
    const PickleGraph graph = loadPickle(zip.read(prefix + "data.pkl"), name);
    const ReadStorage read = [&](const PickleTensor& tensor, std::vector<std::byte>& scratch) {
        const std::string member = prefix + "data/" + tensor.storage_key;
        if (const uint64_t size = zip.size(member); size != tensor.storage_count * sizeof(float))
            throw Error(ErrorCode::InvalidFile,
                        formatString("%s: member '%s' has %llu bytes, expected %llu float32; save it again",
                                     name.c_str(), member.c_str(), static_cast<unsigned long long>(size),
                                     static_cast<unsigned long long>(tensor.storage_count)));
        scratch = zip.read(member);
        return std::span<const std::byte>(scratch);
    };
    return Walker(graph, read, wanted, bytes.size(), name).run();
}

} // namespace gsc
