// SPDX-License-Identifier: Apache-2.0
#include "player/present/overlay_renderer.h"

#include <gsc/error.h>

#include <imgui.h>

#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_vulkan.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include <unistd.h>

namespace gsc {

namespace {

constexpr float kFontPixels = 16;  // height of the font in pixels at 96 dots per inch
constexpr float kPlainPixels = 13; // height that Dear ImGui's own font is drawn for; only multiples of it are sharp
// a font that most desktops have; where there is none, Dear ImGui's own is taken
constexpr const char* kFonts[] = {
    "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf",
    "/usr/share/fonts/dejavu-sans-fonts/DejaVuSans.ttf",
    "/usr/share/fonts/TTF/DejaVuSans.ttf",
    "/usr/share/fonts/truetype/liberation/LiberationSans-Regular.ttf",
    "/usr/share/fonts/liberation-sans/LiberationSans-Regular.ttf",
    "/usr/share/fonts/truetype/noto/NotoSans-Regular.ttf",
    "/usr/share/fonts/noto/NotoSans-Regular.ttf",
    "/usr/share/fonts/truetype/ubuntu/Ubuntu-R.ttf",
    "/usr/share/fonts/truetype/freefont/FreeSans.ttf",
};
// colours of a note's ground and text
constexpr ImU32 kGround = IM_COL32(0, 0, 0, 160), kInk = IM_COL32(255, 255, 255, 255);

void drawHint(const OverlayItem& item)
{
    if (!item.text.empty() && ImGui::IsItemHovered())
        ImGui::SetTooltip("%s", item.text.c_str());
}

bool drawChoice(OverlayItem& item)
{
    const char* const now =
        item.choice >= 0 && size_t(item.choice) < item.choices.size() ? item.choices[size_t(item.choice)].c_str() : "";
    if (!ImGui::BeginCombo(item.label.c_str(), now))
        return false;
    bool changed = false;
    for (size_t i = 0; i < item.choices.size(); ++i)
        if (ImGui::Selectable((item.choices[i] + "##" + std::to_string(i)).c_str(), item.choice == int(i))) {
            item.choice = int(i);
            changed = true;
        }
    ImGui::EndCombo();
    return changed;
}

void drawPlot(const OverlayItem& item)
{
    const auto& values = item.history;
    const float most = values.empty() ? 1 : std::max(*std::ranges::max_element(values), 1e-6f);
    const std::string now = !item.text.empty() ? item.text
                            : values.empty()   ? ""
                                               : formatString("%.3g, most %.3g", double(values.back()), double(most));
    ImGui::PlotLines(item.label.c_str(), values.data(), int(values.size()), 0, now.c_str(), 0, most * 1.1f,
                     ImVec2(0, 2.4f * ImGui::GetFontSize()));
}

void drawItem(OverlayItem& item)
{
    ImGui::BeginDisabled(!item.enabled);
    switch (item.kind) {
    case OverlayItem::Kind::Heading:
        break;
    case OverlayItem::Kind::Text:
        ImGui::TextUnformatted((item.label + ": " + item.text).c_str());
        break;
    case OverlayItem::Kind::Plot:
        drawPlot(item);
        break;
    case OverlayItem::Kind::Toggle:
        item.changed |= ImGui::Checkbox(item.label.c_str(), &item.on);
        drawHint(item);
        break;
    case OverlayItem::Kind::Choice:
        item.changed |= drawChoice(item);
        drawHint(item);
        break;
    case OverlayItem::Kind::Slider:
        item.changed |= ImGui::SliderFloat(item.label.c_str(), &item.value, item.least, item.most, "%.3g",
                                           ImGuiSliderFlags_AlwaysClamp);
        drawHint(item);
        break;
    case OverlayItem::Kind::Button:
        item.changed |= ImGui::Button(item.label.c_str());
        drawHint(item);
        break;
    case OverlayItem::Kind::Colour:
        item.changed |= ImGui::ColorEdit3(item.label.c_str(), item.colour);
        drawHint(item);
        break;
    }
    ImGui::EndDisabled();
}

void drawPanel(Overlay& overlay)
{
    const ImVec2 screen = ImGui::GetIO().DisplaySize;
    ImGui::SetNextWindowPos(ImVec2(8, 8), ImGuiCond_FirstUseEver);
    ImGui::SetNextWindowSize(ImVec2(std::min(26 * ImGui::GetFontSize(), screen.x - 16), screen.y - 16),
                             ImGuiCond_FirstUseEver);
    if (overlay.takes_keys)
        ImGui::SetNextWindowFocus();
    if (ImGui::Begin("gsc", &overlay.panel, ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoSavedSettings)) {
        ImGui::PushItemWidth(-10 * ImGui::GetFontSize());
        bool open = true;
        for (OverlayItem& item : overlay.items) {
            if (item.kind == OverlayItem::Kind::Heading) {
                ImGui::SetNextItemOpen(item.on, ImGuiCond_Once);
                open = ImGui::CollapsingHeader(item.label.c_str());
                continue;
            }
            if (open)
                drawItem(item);
        }
        ImGui::PopItemWidth();
    }
    ImGui::End();
    overlay.takes_keys = false;
}

void drawHelp(Overlay& overlay)
{
    const ImVec2 screen = ImGui::GetIO().DisplaySize;
    ImGui::SetNextWindowPos(ImVec2(screen.x / 2, screen.y / 2), ImGuiCond_Always, ImVec2(0.5f, 0.5f));
    ImGui::SetNextWindowSizeConstraints(ImVec2(0, 0), ImVec2(screen.x - 16, screen.y - 16));
    if (ImGui::Begin("Keys", &overlay.help,
                     ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoFocusOnAppearing |
                         ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoCollapse) &&
        ImGui::BeginTable("keys", 2, ImGuiTableFlags_SizingFixedFit | ImGuiTableFlags_RowBg)) {
        for (const auto& [key, does] : overlay.keys) {
            ImGui::TableNextRow();
            ImGui::TableNextColumn();
            ImGui::TextUnformatted(key.c_str());
            ImGui::TableNextColumn();
            // lines are broken at the edge of the screen, less borders and a scroll bar
            const float column = ImGui::GetCursorPosX();
            ImGui::PushTextWrapPos(std::max(screen.x - 3 * ImGui::GetFontSize(), column + 8 * ImGui::GetFontSize()));
            ImGui::TextUnformatted(does.c_str());
            ImGui::PopTextWrapPos();
        }
        ImGui::EndTable();
    }
    ImGui::End();
}

// Draws a note's text on a dark ground, over windows of the overlay as well. Lines that are too long for the window
// are broken.
void drawNote(const OverlayNote& note)
{
    const ImVec2 screen = ImGui::GetIO().DisplaySize;
    const float edge = 0.4f * ImGui::GetFontSize(), wrap = std::max(screen.x - 4 * edge, 1.0f);
    const ImVec2 size = ImGui::CalcTextSize(note.text.c_str(), nullptr, false, wrap);
    const float share = note.align == OverlayNote::Align::Left ? 0 : note.align == OverlayNote::Align::Right ? 1 : 0.5f;
    ImVec2 at(note.x * screen.x - share * size.x, edge + note.y * (screen.y - size.y - 2 * edge));
    at.x = std::clamp(at.x, 2 * edge, std::max(screen.x - size.x - 2 * edge, 2 * edge));
    ImDrawList* const list = ImGui::GetForegroundDrawList();
    list->AddRectFilled(ImVec2(at.x - edge, at.y - edge), ImVec2(at.x + size.x + edge, at.y + size.y + edge), kGround,
                        edge);
    list->AddText(nullptr, 0, at, kInk, note.text.c_str(), nullptr, wrap);
}

// Draws the legend as one row at the right. In a narrow window it starts at the left and continues in further rows.
void drawLegend(const OverlayLegend& legend)
{
    if (legend.colours.empty())
        return;
    const float font = ImGui::GetFontSize(), edge = 0.4f * font, screen = ImGui::GetIO().DisplaySize.x;
    const auto width_of = [&](const std::string& text, bool square) {
        return ImGui::CalcTextSize(text.c_str()).x + (square ? font + edge : 0) + 2 * edge;
    };
    float all = width_of(legend.title, false);
    for (const OverlayLegend::Colour& colour : legend.colours)
        all += width_of(colour.text, true);
    const float left = 2 * edge;
    ImVec2 at(std::max(screen - all, left), 2.5f * font);
    ImDrawList* const list = ImGui::GetForegroundDrawList();
    const auto write = [&](const std::string& text, const float* rgb) {
        const float width = width_of(text, rgb != nullptr), square = rgb != nullptr ? font + edge : 0;
        if (at.x + width - edge > screen)
            at = ImVec2(left, at.y + font + 2 * edge);
        list->AddRectFilled(ImVec2(at.x - edge, at.y - edge), ImVec2(at.x + width - edge, at.y + font + edge), kGround);
        if (rgb != nullptr)
            list->AddRectFilled(at, ImVec2(at.x + font, at.y + font),
                                ImGui::ColorConvertFloat4ToU32(ImVec4(rgb[0], rgb[1], rgb[2], 1)));
        list->AddText(ImVec2(at.x + square, at.y), kInk, text.c_str());
        at.x += width;
    };
    write(legend.title, nullptr);
    for (const OverlayLegend::Colour& colour : legend.colours)
        write(colour.text, colour.rgb);
}

} // namespace

OverlayRenderer::OverlayRenderer(const VulkanDevice& device, GlfwWindow& window, VkRenderPass pass, VkCommandPool pool)
    : m_device(device), m_pool(pool), m_window(window)
{
    const VkDescriptorPoolSize sizes{VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 16};
    auto descriptors = vulkanInfo<VkDescriptorPoolCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO);
    descriptors.flags = VK_DESCRIPTOR_POOL_CREATE_FREE_DESCRIPTOR_SET_BIT;
    descriptors.maxSets = 16;
    descriptors.poolSizeCount = 1;
    descriptors.pPoolSizes = &sizes;
    checkVulkan(vkCreateDescriptorPool(device.handle, &descriptors, nullptr, &m_descriptors), "vkCreateDescriptorPool");

    IMGUI_CHECKVERSION();
    ImGui::CreateContext();
    ImGui::GetIO().IniFilename = nullptr; // no file imgui.ini is written
    ImGui::GetIO().ConfigFlags |= ImGuiConfigFlags_NavEnableKeyboard;
    ImGui::StyleColorsDark();
    ImGui_ImplGlfw_InitForVulkan(window.handle(), true);
    ImGui_ImplVulkan_InitInfo info{};
    info.Instance = device.instance;
    info.PhysicalDevice = device.physical;
    info.Device = device.handle;
    info.QueueFamily = device.family;
    info.Queue = device.queue;
    info.DescriptorPool = m_descriptors;
    info.MinImageCount = 2;
    info.ImageCount = 3; // number of buffers that are used in turn: at least the frames in flight
    info.MSAASamples = VK_SAMPLE_COUNT_1_BIT;
    info.CheckVkResultFn = [](VkResult result) { checkVulkan(result, "the overlay"); };
    ImGui_ImplVulkan_Init(&info, pass);
}

OverlayRenderer::~OverlayRenderer()
{
    ImGui_ImplVulkan_Shutdown();
    GlfwWindow::unlessGone([] { // GLFW's cursors belong to the display, which may have gone
        ImGui_ImplGlfw_Shutdown();
        ImGui::DestroyContext();
    });
    vkDestroyDescriptorPool(m_device.handle, m_descriptors, nullptr);
}

// Makes the font in the scale of the screen that the window is on. Waits for the GPU, which does no harm: a window
// rarely changes screens.
void OverlayRenderer::makeFont(float scale)
{
    m_scale = scale;
    ImGuiIO& io = ImGui::GetIO();
    io.Fonts->Clear();
    const auto* const file = std::ranges::find_if(kFonts, [](const char* font) { return ::access(font, R_OK) == 0; });
    if (file == std::end(kFonts) || io.Fonts->AddFontFromFileTTF(*file, std::round(kFontPixels * scale)) == nullptr) {
        ImFontConfig font;
        font.SizePixels = kPlainPixels * std::max(1.0f, std::round(kFontPixels / kPlainPixels * scale));
        io.Fonts->AddFontDefault(&font);
    }
    ImGui::GetStyle() = ImGuiStyle();
    ImGui::StyleColorsDark();
    ImGui::GetStyle().ScaleAllSizes(scale);

    auto buffers = vulkanInfo<VkCommandBufferAllocateInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO);
    buffers.commandPool = m_pool;
    buffers.commandBufferCount = 1;
    VkCommandBuffer commands = VK_NULL_HANDLE;
    checkVulkan(vkDeviceWaitIdle(m_device.handle), "vkDeviceWaitIdle");
    checkVulkan(vkAllocateCommandBuffers(m_device.handle, &buffers, &commands), "vkAllocateCommandBuffers");
    auto begin = vulkanInfo<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
    begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    checkVulkan(vkBeginCommandBuffer(commands, &begin), "vkBeginCommandBuffer");
    ImGui_ImplVulkan_CreateFontsTexture(commands);
    checkVulkan(vkEndCommandBuffer(commands), "vkEndCommandBuffer");
    auto submit = vulkanInfo<VkSubmitInfo>(VK_STRUCTURE_TYPE_SUBMIT_INFO);
    submit.commandBufferCount = 1;
    submit.pCommandBuffers = &commands;
    checkVulkan(vkQueueSubmit(m_device.queue, 1, &submit, VK_NULL_HANDLE), "vkQueueSubmit");
    checkVulkan(vkQueueWaitIdle(m_device.queue), "vkQueueWaitIdle");
    ImGui_ImplVulkan_DestroyFontUploadObjects();
    vkFreeCommandBuffers(m_device.handle, m_pool, 1, &commands);
}

void OverlayRenderer::layOut(Overlay& overlay)
{
    if (m_window.scale() != m_scale)
        makeFont(m_window.scale());
    ImGui_ImplVulkan_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    ImGui::NewFrame();
    if (overlay.panel)
        drawPanel(overlay);
    else if (m_had_panel)
        ImGui::SetWindowFocus(nullptr); // keys move the camera again
    m_had_panel = overlay.panel;
    if (overlay.help)
        drawHelp(overlay);
    drawLegend(overlay.legend);
    for (const OverlayNote& note : overlay.notes)
        drawNote(note);
    if (!overlay.message.empty())
        drawNote({OverlayNote::Align::Middle, 0.5f, 0.93f, overlay.message});
    ImGui::Render();
}

void OverlayRenderer::record(VkCommandBuffer commands)
{
    ImGui_ImplVulkan_RenderDrawData(ImGui::GetDrawData(), commands);
}

} // namespace gsc
