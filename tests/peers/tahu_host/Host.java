import java.io.BufferedReader;
import java.io.InputStreamReader;
import java.lang.reflect.Proxy;
import java.util.Date;
import java.util.List;
import java.util.Map;
import org.eclipse.tahu.host.HostApplication;
import org.eclipse.tahu.host.api.HostApplicationEventHandler;
import org.eclipse.tahu.message.SparkplugBPayloadDecoder;
import org.eclipse.tahu.message.model.MessageType;
import org.eclipse.tahu.message.model.Metric;
import org.eclipse.tahu.message.model.Metric.MetricBuilder;
import org.eclipse.tahu.message.model.MetricDataType;
import org.eclipse.tahu.message.model.PropertySet;
import org.eclipse.tahu.message.model.SparkplugBPayload.SparkplugBPayloadBuilder;
import org.eclipse.tahu.message.model.SparkplugDescriptor;
import org.eclipse.tahu.message.model.Topic;
import org.eclipse.tahu.model.MqttServerDefinition;
import org.eclipse.tahu.mqtt.MqttClientId;
import org.eclipse.tahu.mqtt.MqttServerName;
import org.eclipse.tahu.mqtt.MqttServerUrl;

/**
 * A host application of Eclipse Tahu, the reference implementation of Sparkplug: what it understands of the edge nodes
 * of a group goes to standard output, a line for each event; lines of standard input are commands.
 *
 * Arguments: host, port, id of the host, group, and optionally name and password. Commands, separated by tabs: rebirth NODE;
 * command NODE DEVICE METRIC TYPE VALUE (DEVICE may be empty); quit.
 */
public class Host {
    private static final MqttServerName SERVER = new MqttServerName("broker");

    public static void main(String[] arguments) throws Exception {
        String id = arguments[2];
        String group = arguments[3];
        MqttServerUrl url = new MqttServerUrl("tcp://" + arguments[0] + ":" + arguments[1]);
        String user = arguments.length > 4 ? arguments[4] : null;
        String password = arguments.length > 5 ? arguments[5] : null;
        MqttServerDefinition server =
                new MqttServerDefinition(SERVER, new MqttClientId(id, false), url, user, password, 30, null);
        HostApplicationEventHandler events = (HostApplicationEventHandler) Proxy.newProxyInstance(
                Host.class.getClassLoader(),
                new Class<?>[] {HostApplicationEventHandler.class},
                (proxy, method, given) -> {
                    say(method.getName(), given);
                    return null;
                });
        HostApplication host = new HostApplication(
                events, id, List.of("spBv1.0/" + group + "/#"), List.of(server), null, new SparkplugBPayloadDecoder(), true);
        host.start(true);
        BufferedReader input = new BufferedReader(new InputStreamReader(System.in));
        for (String line = input.readLine(); line != null && !line.equals("quit"); line = input.readLine()) {
            String[] words = line.split("\t", -1);
            if (words[0].equals("rebirth")) {
                command(host, group, words[1], "", "Node Control/Rebirth", "Boolean", "true");
            } else {
                command(host, group, words[1], words[2], words[3], words[4], words[5]);
            }
        }
        host.shutdown();
        System.exit(0);
    }

    private static void command(
            HostApplication host, String group, String node, String device, String name, String type, String value)
            throws Exception {
        MetricDataType kind = (MetricDataType) MetricDataType.class.getField(type).get(null);
        Metric metric = new MetricBuilder(name, kind, parse(type, value)).timestamp(new Date()).createMetric();
        Topic topic = device.isEmpty()
                ? new Topic("spBv1.0", group, node, MessageType.NCMD)
                : new Topic("spBv1.0", group, node, device, MessageType.DCMD);
        host.publishCommand(SERVER, topic, new SparkplugBPayloadBuilder().setTimestamp(new Date()).addMetric(metric).createPayload());
    }

    private static Object parse(String type, String value) {
        return switch (type) {
            case "Boolean" -> Boolean.valueOf(value);
            case "Int8" -> Byte.valueOf(value);
            case "Int16", "UInt8" -> Short.valueOf(value);
            case "Int32", "UInt16" -> Integer.valueOf(value);
            case "Int64", "UInt32" -> Long.valueOf(value);
            case "Float" -> Float.valueOf(value);
            case "Double" -> Double.valueOf(value);
            default -> value;
        };
    }

    private static synchronized void say(String event, Object[] given) {
        StringBuilder line = new StringBuilder(event);
        for (Object one : given == null ? new Object[0] : given) {
            if (one instanceof SparkplugDescriptor) {
                line.append('\t').append(((SparkplugDescriptor) one).getDescriptorString());
            } else if (one instanceof Metric) {
                line.append('\t').append(words((Metric) one));
            }
        }
        System.out.println(line);
        System.out.flush();
    }

    private static String words(Metric metric) {
        PropertySet properties = metric.getProperties();
        StringBuilder found = new StringBuilder();
        if (properties != null) {
            for (Map.Entry<String, ?> one : properties.getPropertyMap().entrySet()) {
                found.append('\t').append(one.getKey()).append('=').append(properties.getPropertyValue(one.getKey()).getValue());
            }
        }
        return metric.getName() + "\t" + metric.getDataType() + "\t" + metric.getValue() + "\t"
                + (Boolean.TRUE.equals(metric.isHistorical()) ? "historical" : "live") + "\t"
                + (metric.getTimestamp() == null ? "" : metric.getTimestamp().getTime()) + found;
    }
}
