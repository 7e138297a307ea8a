/* Hears topics by Fast DDS, which ROS 2 has as its default, on the loopback interface only.

     fast_dds_listener DOMAIN FOLDER TOPIC=TYPE ...

   Says "matched TOPIC" once a writer of that topic and type was found, and "gone TOPIC". Ends with
   its standard input. Then, for topic k from 0, FOLDER/k.bin holds each message as it came: its
   length in four bytes, little endian, and its CDR bytes. */
#include <cstdlib>
#include <deque>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#include <fstream>
#include <iostream>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

using namespace eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

constexpr uint32_t LARGEST_bytes = 8192;
constexpr char LOOPBACK[] = "127.0.0.1";

using Bytes = std::vector<char>;

/* Any type: its bytes, the four of the encapsulation first. */
class Undecoded : public TopicDataType {
public:
  explicit Undecoded(const std::string &name) {
    setName(name.c_str());
    m_typeSize = LARGEST_bytes;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }
  bool serialize(void *, rtps::SerializedPayload_t *) override { return false; }
  bool deserialize(rtps::SerializedPayload_t *payload, void *data) override {
    const char *bytes = reinterpret_cast<const char *>(payload->data);
    static_cast<Bytes *>(data)->assign(bytes, bytes + payload->length);
    return true;
  }
  std::function<uint32_t()> getSerializedSizeProvider(void *) override {
    return [] { return LARGEST_bytes; };
  }
  void *createData() override { return new Bytes; }
  void deleteData(void *data) override { delete static_cast<Bytes *>(data); }
  bool getKey(void *, rtps::InstanceHandle_t *, bool) override { return false; }
};

class Ear : public DataReaderListener {
public:
  Ear(std::string topic, const std::string &folder, size_t number)
      : topic_(std::move(topic)), file_(folder + "/" + std::to_string(number) + ".bin") {}

  void on_subscription_matched(DataReader *, const SubscriptionMatchedStatus &status) override {
    const std::lock_guard lock(shared_);
    std::cout << (status.current_count_change > 0 ? "matched " : "gone ") << topic_ << std::endl;
  }

  void on_data_available(DataReader *reader) override {
    Bytes message;
    SampleInfo info;
    while (reader->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data)
        continue;
      const auto length = static_cast<uint32_t>(message.size());
      for (int shift = 0; shift < 32; shift += 8)
        file_.put(static_cast<char>(length >> shift));
      file_.write(message.data(), length).flush();
    }
  }

private:
  static inline std::mutex shared_; // standard output
  std::string topic_;
  std::ofstream file_;
};

static DomainParticipantQos loopback_only() {
  DomainParticipantQos qos = PARTICIPANT_QOS_DEFAULT;
  auto transport = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  transport->interfaceWhiteList.emplace_back(LOOPBACK);
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(transport);
  rtps::Locator_t peer;
  rtps::IPLocator::setIPv4(peer, LOOPBACK);
  qos.wire_protocol().builtin.initialPeersList.push_back(peer);
  return qos;
}

static int listen(int domain, const std::string &folder, const std::vector<std::string> &wanted) {
  auto *factory = DomainParticipantFactory::get_instance();
  DomainParticipant *participant = factory->create_participant(static_cast<DomainId_t>(domain), loopback_only());
  if (!participant) {
    std::cerr << "no participant\n";
    return 1;
  }
  Subscriber *subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
  DataReaderQos qos = DATAREADER_QOS_DEFAULT;
  qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
  qos.history().kind = KEEP_ALL_HISTORY_QOS;
  qos.resource_limits().max_samples = 0;
  qos.resource_limits().max_instances = 0;
  qos.resource_limits().max_samples_per_instance = 0;
  std::deque<Ear> ears;
  for (const std::string &each : wanted) {
    const std::string name = each.substr(0, each.find('='));
    const std::string type = each.substr(each.find('=') + 1);
    TypeSupport(new Undecoded(type)).register_type(participant);
    Topic *topic = participant->create_topic(name, type, TOPIC_QOS_DEFAULT);
    ears.emplace_back(name, folder, ears.size());
    if (!topic || !subscriber->create_datareader(topic, qos, &ears.back())) {
      std::cerr << "no reader of " << each << '\n';
      return 1;
    }
  }
  while (std::getchar() != EOF)
    continue;
  participant->delete_contained_entities();
  factory->delete_participant(participant);
  return 0;
}

int main(int argc, char **argv) {
  if (argc < 4) {
    std::cerr << "usage: fast_dds_listener DOMAIN FOLDER TOPIC=TYPE ...\n";
    return 2;
  }
  return listen(std::atoi(argv[1]), argv[2], {argv + 3, argv + argc});
}
